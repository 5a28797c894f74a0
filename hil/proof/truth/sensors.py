"""What the recording shows of a quantity: noise and resolution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from hil.proof.truth.experiments import PERIOD_S
from hil.proof.truth.physics import FloatArray

TORQUE_QUANTUM_NM = 0.6
"""0.1 % of a rated torque of 600 Nm: the resolution of object 0x6077."""

TORQUE_NOISE_NM = 0.5
SPEED_NOISE_RAD_S = 0.05


@dataclass(frozen=True, slots=True)
class Noise:
    """What a faultless sensor adds to a quantity: standard deviations, and the resolution of the torque.

    Besides the white noise of speed and torque there may be coloured noise of the speed, and a drift of each torque
    reading: of first order, with these corner frequencies.
    """

    speed_rad_s: float = SPEED_NOISE_RAD_S
    torque_nm: float = TORQUE_NOISE_NM
    torque_quantum_nm: float = TORQUE_QUANTUM_NM
    coloured_rad_s: float = 0.0
    coloured_hz: float = 5.0
    torque_drift_nm: float = 0.0
    torque_drift_hz: float = 0.05


USUAL = Noise()
SILENT = Noise(0.0, 0.0, 0.0)
"""Draws as many numbers as `USUAL`, so that all that is drawn after them is the same."""


def torque_reading(torque_nm: FloatArray, rng: np.random.Generator, noise: Noise = USUAL) -> FloatArray:
    """Return the inverter's torque actual value [Nm] for a true current torque."""
    noisy = torque_nm + rng.normal(0.0, noise.torque_nm, torque_nm.shape)
    noisy += coloured(noise.torque_drift_nm, noise.torque_drift_hz, torque_nm.shape, rng)
    if noise.torque_quantum_nm <= 0.0:
        return noisy
    return np.round(noisy / noise.torque_quantum_nm) * noise.torque_quantum_nm


def speed_reading(speed_rad_s: FloatArray, rng: np.random.Generator, noise: Noise = USUAL) -> FloatArray:
    """Return the resolver's noisy speed [rad/s]."""
    white = rng.normal(0.0, noise.speed_rad_s, speed_rad_s.shape)
    return speed_rad_s + white + coloured(noise.coloured_rad_s, noise.coloured_hz, speed_rad_s.shape, rng)


def coloured(size: float, corner_hz: float, shape: tuple[int, ...], rng: np.random.Generator) -> FloatArray:
    """Return noise of first order along the first axis, of a standard deviation and corner; none draws no numbers."""
    if size == 0.0:
        return np.zeros(shape)
    kept = float(np.exp(-2.0 * np.pi * corner_hz * PERIOD_S))
    driven = rng.normal(0.0, size * np.sqrt(1.0 - kept**2), shape)
    driven[0] = rng.normal(0.0, size, shape[1:])
    noise: FloatArray = lfilter([1.0], [1.0, -kept], driven, axis=0)
    return noise
