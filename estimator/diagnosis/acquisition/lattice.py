"""The lattice a channel's values lie on: how fine it is, and how often neighbours repeat on it by chance.

Whatever is written with so many decimals, or counted, lies on a lattice of step q, and two readings in a row are
then equal now and then without any fault. How often follows from the readings themselves: their differences fall
on 0, +-q, +-2q, ... with probabilities that vary smoothly, so those near zero predict the one at zero.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from estimator.signals.record import BoolArray, FloatArray

STEP_QUANTILE = 0.02
"""The step is taken at this quantile of the gaps between the values: on a coarse lattice most gaps are the step; on
one so fine that gaps are a matter of chance it is too large, which errs to the side of calling repeats innocent."""

CORE_QUANTILE = 0.05
"""Differences that count as near zero: the smallest twentieth of them. A density varies little over that."""

DECIMALS = 9
"""Values with more decimals than this are taken as not rounded."""

ROUND_OFF = 1e-9
"""Values closer than this share of the largest are the same number, scaled in another way."""


def lattice_step(values: FloatArray) -> float:
    """Return the step of the lattice that values lie on [unit of the values]; tiny where they lie on none.

    0 for fewer than three different values.
    """
    levels = np.unique(values[np.isfinite(values)])
    if levels.size < 3:
        return 0.0
    gaps = np.diff(levels)
    gaps = gaps[gaps > ROUND_OFF * float(np.abs(levels).max())]
    return float(np.quantile(gaps, STEP_QUANTILE, method="lower")) if gaps.size else 0.0


def decimal_place(values: FloatArray) -> float:
    """Return the decimal place that values were rounded to when they were written [their unit], 0 where to none."""
    for decimals in range(DECIMALS + 1):
        ticks = values * 10.0**decimals
        if float(np.abs(ticks - np.round(ticks)).max()) < 1e-6 * max(1.0, 1e-9 * float(np.abs(ticks).max())):
            return float(10.0**-decimals)
    return 0.0


@dataclass(frozen=True, slots=True)
class ChanceRepeats:
    """How often a reading equals the one before by chance.

    Attributes
    ----------
    expected : float
        Best estimate of their number.
    upper : float
        With the error of that estimate added twice, and at least as many as there are of any other change: on a lattice
        with a coarser one inside (values interpolated between counts) these stand out likewise.
    """

    expected: float
    upper: float


MODEL_ERROR = 0.1
"""Relative error of extrapolating the density to zero, in addition to its sampling error."""


def chance_repeats(differences: FloatArray, step: float) -> ChanceRepeats:
    """Predict from differences other than zero how many are zero.

    A Gaussian is drawn through the counts of two bands next to zero, ``0 < |d| <= w`` and ``w < |d| <= 2w``: it has
    ``ln p(d)`` linear in d^2, and locally so has every smooth density that is symmetric about zero.

    Parameters
    ----------
    differences : ndarray, shape (n,)
        Of readings in a row, zeros included.
    step : float
        Of the lattice.
    """
    size = np.abs(differences)
    moving = size[size > 0.5 * step] if step > 0.0 else size[size > 0.0]
    if moving.size == 0:
        return ChanceRepeats(float(size.size), float(size.size))
    if step <= 0.0:  # without a lattice none is zero by chance
        return ChanceRepeats(0.0, _most_common(differences, step))
    points = max(1, math.floor(float(np.quantile(moving, CORE_QUANTILE)) / step + 0.5))
    near = float(np.sum(moving <= (points + 0.5) * step))
    far = float(np.sum(moving <= (2 * points + 0.5) * step)) - near
    # Half an event more keeps the logarithms finite where a band is empty.
    near_rate, far_rate = (near + 0.5) / (2 * points), (far + 0.5) / (2 * points)
    inner, whole = ((n + 1) * (2 * n + 1) / 6.0 for n in (points, 2 * points))  # mean squares of the lags up to n
    lever = inner / (2.0 * (whole - inner))
    slope = max(math.log(near_rate / far_rate), 0.0)
    expected = near_rate * math.exp(lever * slope)
    sampling = math.hypot((1.0 + lever) / math.sqrt(near + 0.5), lever / math.sqrt(far + 0.5))
    upper = max(expected * (1.0 + MODEL_ERROR + 2.0 * sampling), _most_common(differences, step))
    return ChanceRepeats(min(expected, float(size.size)), min(upper, float(size.size)))


def _most_common(differences: FloatArray, step: float) -> float:
    """Return how often the most common change other than none occurs."""
    counts = np.round(differences / step) if step > 0.0 else differences
    _, times = np.unique(counts[counts != 0.0], return_counts=True)
    return float(times.max()) if times.size else 0.0


def repeats(values: FloatArray, step: float) -> BoolArray:
    """Return the rows whose reading equals the one before, shape (N,); False in the first and where none was read."""
    found = np.zeros(values.shape, dtype=np.bool_)
    read = values[np.isfinite(values)]
    if read.size:
        found[1:] = np.abs(np.diff(values)) <= ROUND_OFF * max(float(np.abs(read).max()), step)
    return found
