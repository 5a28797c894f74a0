"""The resonance of every estimate of a block."""

from __future__ import annotations

import numpy as np

from estimator.identification.linear_model import LinearModel, Orders
from estimator.identification.modes.modes import resonance
from estimator.identification.online.recursive import Reason, Trajectory
from estimator.signals.record import FloatArray


def resonances(estimates: Trajectory, orders: Orders, sample_time_s: float, band_hz: tuple[float, float]) -> FloatArray:
    """Return frequency [Hz], damping and height of the dominant mode, shape (3, n); NaN where there is none."""
    found = np.full((3, len(estimates)), np.nan)
    for k in np.flatnonzero(estimates.reason == Reason.NONE):
        mode = resonance(LinearModel.from_theta(estimates.theta[k], orders, sample_time_s), band_hz)
        if mode is not None:
            found[:, k] = mode.frequency_hz, mode.damping, mode.height
    return found
