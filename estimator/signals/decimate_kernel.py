"""The compiled loop behind :mod:`estimator.signals.decimate`; one code for a block and for a single sample.

Every state is an array of the caller's, so a block and the same samples one by one give the same bits.
"""

from __future__ import annotations

import numpy as np

from estimator.compiled import compiled
from estimator.signals.record import BoolArray, FloatArray

# Rows of the signal arrays.
U = 0
Y = 1

# Places in `counters`.
PHASE = 0  # samples until the next output
SPOILT = 1  # samples during which the window of the filter still holds a bad one
STARTED = 2  # 1 once the running means have a first value; then the sample counts towards the mask

# Places in `level`, after the running means of u and y in U and Y.
HELD_U = 2
HELD_Y = 3
CONTAMINATION = 4

LARGEST = 1e30  # beyond it a value is no measurement, as for the estimators; the means can't overflow below
UNTRUSTED = 0.5  # share of held values in a running mean from which on it is not trusted


@compiled
def _take(u: float, y: float, okay: bool, level: FloatArray) -> bool:
    """Hold the last good value in place of one that can't be used; tell whether both could be."""
    u_fits = abs(u) <= LARGEST
    y_fits = okay and abs(y) <= LARGEST
    if u_fits:
        level[HELD_U] = u
    if y_fits:
        level[HELD_Y] = y
    return okay and u_fits and y_fits


@compiled
def _remove_mean(good: bool, share: float, level: FloatArray, window: FloatArray) -> None:
    """High-pass both signals into the newest place of the window: x minus its exponentially weighted mean."""
    for row in (U, Y):
        held = level[HELD_U + row]
        level[row] += share * (held - level[row])
        for i in range(window.shape[1] - 1, 0, -1):
            window[row, i] = window[row, i - 1]
        window[row, 0] = held - level[row]
    level[CONTAMINATION] += share * ((0.0 if good else 1.0) - level[CONTAMINATION])


@compiled
def decimate_block(
    u: FloatArray,
    y: FloatArray,
    okay: BoolArray,
    share: float,
    factor: int,
    taps: FloatArray,
    counters: np.ndarray,
    level: FloatArray,
    window: FloatArray,
    out: FloatArray,
    out_okay: BoolArray,
) -> int:
    """Run the samples of a block through high-pass, low-pass and decimation; return the number of outputs.

    Parameters
    ----------
    u, y, okay
        Samples of the block, shape (N,).
    share
        Weight of a new sample in the running means.
    taps
        Low-pass, shape (L,).
    counters, level, window
        State, shapes (3,), (5,) and (2, L).
    out, out_okay
        Outputs, shapes (2, n) and (n,) with n at least N / factor + 1.
    """
    produced = 0
    for t in range(u.shape[0]):
        good = _take(u[t], y[t], okay[t], level)
        if counters[STARTED] == 0 and good:
            level[U], level[Y] = u[t], y[t]
            counters[STARTED] = 1
        _remove_mean(good, share, level, window)
        counters[SPOILT] = max(counters[SPOILT] - 1, 0)
        if not good or level[CONTAMINATION] > UNTRUSTED:
            counters[SPOILT] = taps.shape[0]
        if counters[PHASE] == 0:
            counters[PHASE] = factor
            filtered_u, filtered_y = 0.0, 0.0
            for i in range(taps.shape[0]):
                filtered_u += taps[i] * window[U, i]
                filtered_y += taps[i] * window[Y, i]
            out[U, produced], out[Y, produced] = filtered_u, filtered_y
            out_okay[produced] = counters[SPOILT] == 0 and counters[STARTED] == 1
            produced += 1
        counters[PHASE] -= 1
    return produced
