"""From the true speed to the number the sensor gives, and when it is asked.

In this order: curvature of the gain, noise, loss of the sign, number format.
"""

from __future__ import annotations

import numpy as np

from hil.proof.truth.acquisition import Acquisition
from hil.proof.truth.physics import FloatArray
from hil.proof.truth.sensors import USUAL, Noise, speed_reading

CURVATURE_SPEED_RAD_S = 100.0
"""Speed at which the curvature's share of the reading is missing."""


def sampling_instants_s(time_s: FloatArray, acquisition: Acquisition, rng: np.random.Generator) -> FloatArray:
    """Return when each speed is truly sampled [s], shape (N,); none is before the recording begins."""
    instants = time_s * (1.0 + acquisition.clock_error)
    if acquisition.jitter_s > 0.0:
        instants = instants + rng.uniform(-acquisition.jitter_s, acquisition.jitter_s, time_s.shape)
    return np.maximum(instants, 0.0)


def speed_as_read(
    speed_rad_s: FloatArray, acquisition: Acquisition, rng: np.random.Generator, noise: Noise = USUAL
) -> FloatArray:
    """Return what the sensor gives for a true speed [rad/s], shape (N,)."""
    a = acquisition
    reading = speed_rad_s * (1.0 - a.curvature * np.abs(speed_rad_s) / CURVATURE_SPEED_RAD_S)
    reading = speed_reading(reading, rng, noise)
    if a.sign_blind:
        reading = np.abs(reading)
    if a.grid_rad_s > 0.0:
        reading = np.round(reading / a.grid_rad_s) * a.grid_rad_s
    if a.count_rad > 0.0:
        reading = _counted(reading, a.count_rad, a.count_time_s, rng)
    return reading


def _counted(speed_rad_s: FloatArray, count_rad: float, time_s: float, rng: np.random.Generator) -> FloatArray:
    """Return what the counts of an encoder make of a speed, in a time so short that it is constant in it.

    Where in a count the shaft stands when the time begins is as good as random.
    """
    counts = np.floor(speed_rad_s * time_s / count_rad + rng.uniform(0.0, 1.0, speed_rad_s.shape))
    return counts * count_rad / time_s
