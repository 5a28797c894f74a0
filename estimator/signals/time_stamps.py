"""The uniform time base behind time stamps that are rounded, or that jitter.

First and last stamp alone would give a period that is off by their jitter over the recording's length: at 2 ms in 30 s
the last row of a simulation would be off by as much. All stamps together, by least squares, are far surer; and a period
is set by people, so of all that the stamps allow the roundest is taken.
"""

from __future__ import annotations

import numpy as np

from estimator.signals.record import FloatArray

DIGITS = 9
"""Digits a period is rounded to at most, so that 0.01 s is 0.01 s in every recording of a rig."""

ALLOWED = 3.0
"""The roundest period within so many standard errors is taken ..."""

MOST = 0.005
"""... but not beyond this share of the period: a few wild stamps determine nothing."""


def uniform_period_s(time_s: FloatArray) -> float:
    """Return the sampling period behind a recording's stamps [s].

    Parameters
    ----------
    time_s : ndarray, shape (N,)
        Stamps, two or more, one per period.
    """
    rows = np.arange(time_s.size) - 0.5 * (time_s.size - 1)
    since = time_s - time_s.mean()
    power = float(rows @ rows)
    slope = float(rows @ since) / power
    left = since - slope * rows
    error = float(np.sqrt(left @ left / max(time_s.size - 2, 1) / power))
    allowed = min(ALLOWED * error, MOST * slope)
    for digits in range(1, DIGITS):
        rounded = float(f"{slope:.{digits}g}")
        if abs(rounded - slope) <= allowed:
            return rounded
    return float(f"{slope:.{DIGITS}g}")
