"""What the recording shows of a quantity: noise and resolution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hil.proof.truth.physics import FloatArray

TORQUE_QUANTUM_NM = 0.6
"""0.1 % of a rated torque of 600 Nm: the resolution of object 0x6077."""

TORQUE_NOISE_NM = 0.5
SPEED_NOISE_RAD_S = 0.05


@dataclass(frozen=True, slots=True)
class Noise:
    """What a faultless sensor adds to a quantity: standard deviations, and the resolution of the torque."""

    speed_rad_s: float = SPEED_NOISE_RAD_S
    torque_nm: float = TORQUE_NOISE_NM
    torque_quantum_nm: float = TORQUE_QUANTUM_NM


USUAL = Noise()
SILENT = Noise(0.0, 0.0, 0.0)
"""Draws as many numbers as `USUAL`, so that all that is drawn after them is the same."""


def torque_reading(torque_nm: FloatArray, rng: np.random.Generator, noise: Noise = USUAL) -> FloatArray:
    """Return the inverter's torque actual value [Nm] for a true current torque."""
    noisy = torque_nm + rng.normal(0.0, noise.torque_nm, torque_nm.shape)
    if noise.torque_quantum_nm <= 0.0:
        return noisy
    return np.round(noisy / noise.torque_quantum_nm) * noise.torque_quantum_nm


def speed_reading(speed_rad_s: FloatArray, rng: np.random.Generator, noise: Noise = USUAL) -> FloatArray:
    """Return the resolver's noisy speed [rad/s]."""
    return speed_rad_s + rng.normal(0.0, noise.speed_rad_s, speed_rad_s.shape)
