"""Where a repeated reading would tell: where the signal moves by more than its lattice from row to row.

At standstill, on a coarse lattice, or in a torque without noise that is held for some samples, repeats are what a
healthy recording has. Standstill is left out window by window. A lattice too coarse rules out the whole recording:
windows chosen for their large changes would have few small ones to predict chance repeats from.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from estimator.diagnosis.acquisition.lattice import repeats
from estimator.diagnosis.acquisition.readings import runs
from estimator.signals.record import BoolArray, FloatArray

HALF_WINDOW = 25
"""Rows before and after that tell whether the signal moves: long against a stale burst, short against a standstill."""

STEPS_PER_ROW = 1.5
"""The signal moves if all but a quarter of its changes, repeats left out, are larger than so many lattice steps, two
steps that is: where one step is common, a repeat is the likeliest outcome and can't be predicted from its neighbours.
The quarter is taken, not the half, because a torque that jumps every few samples is at rest in between."""

REST_ROWS = 8
"""A run of repeats this long, at zero or at the end of the channel's range, is standstill or saturation."""

NEAR_ZERO = 0.02
"""Zero is within this share of the channel's size."""


def telling_rows(values: FloatArray, step: float) -> BoolArray:
    """Return the rows of a channel in which a repeat would tell, shape (N,).

    Parameters
    ----------
    values : ndarray, shape (N,)
        Readings, NaN where there is none.
    step : float
        Of their lattice.
    """
    change = np.abs(np.diff(values, prepend=np.nan))
    read, again = np.isfinite(change), repeats(values, step)
    tells: BoolArray = read & (_moving_share(read & ~again, read) > 0.5)
    moving = change[tells & ~again]
    if moving.size == 0 or float(np.quantile(moving, 0.25)) <= STEPS_PER_ROW * step:
        return np.zeros_like(tells)
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    for begin, end in runs(again):
        value = values[begin]
        at_rest = abs(value) <= NEAR_ZERO * max(abs(low), abs(high)) or value in (low, high)
        if end - begin >= REST_ROWS and at_rest:
            tells[begin:end] = False
    return tells


def _moving_share(moving: BoolArray, read: BoolArray) -> FloatArray:
    """Return the share of the readings around each row that differ from the one before, shape (N,)."""
    counts = [
        sliding_window_view(np.pad(rows, HALF_WINDOW), 2 * HALF_WINDOW + 1).sum(axis=1) for rows in (moving, read)
    ]
    share: FloatArray = counts[0] / np.maximum(counts[1], 1)
    return share
