"""What the recording shows of a quantity: noise and resolution."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.physics import FloatArray

TORQUE_QUANTUM_NM = 0.6
"""0.1 % of a rated torque of 600 Nm: the resolution of object 0x6077."""

TORQUE_NOISE_NM = 0.5
SPEED_NOISE_RAD_S = 0.05


def torque_reading(torque_nm: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return the inverter's torque actual value [Nm] for a true current torque."""
    noisy = torque_nm + rng.normal(0.0, TORQUE_NOISE_NM, torque_nm.shape)
    return np.round(noisy / TORQUE_QUANTUM_NM) * TORQUE_QUANTUM_NM


def speed_reading(speed_rad_s: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return the resolver's noisy speed [rad/s]."""
    return speed_rad_s + rng.normal(0.0, SPEED_NOISE_RAD_S, speed_rad_s.shape)
