"""Data and a law over bins of a signal; each pass of the signal through a bin is one observation.

Neighbouring samples are not independent, passes nearly are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from estimator.signals.record import BoolArray, FloatArray

BINS = 24

FEWEST_PASSES = 3
"""A bin that the signal passes less often says nothing of its own scatter."""


@dataclass(frozen=True, slots=True)
class Binned:
    """Data and a law over the bins that the signal passes often enough, and how much of the law they tell.

    Attributes
    ----------
    arrays : tuple of ndarray, shape (K,) each
        Signal, data, lower and upper end of the data's 95 % interval, and law.
    explained : float
        Share of the law's power that is a function of the signal.
    """

    arrays: tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]
    explained: float


def binned_by_pass(
    x: Sequence[FloatArray], data: Sequence[FloatArray], law: Sequence[FloatArray], okay: Sequence[BoolArray]
) -> Binned | None:
    """Average data and law over bins of a signal, pass by pass."""
    every = np.concatenate([each[good] for each, good in zip(x, okay, strict=True)])
    low, high = np.percentile(every, [0.5, 99.5])
    if not high > low:
        return None
    edges = _edges(every, float(low), float(high))
    passes = [
        _passes(np.where(good, np.clip(np.digitize(each, edges) - 1, -1, BINS), -1), (each, value, curve))
        for each, value, curve, good in zip(x, data, law, okay, strict=True)
    ]
    where = np.concatenate([bins for bins, _ in passes])
    means = np.concatenate([values for _, values in passes])
    rows = [means[where == each] for each in range(BINS)]
    rows = [row for row in rows if row.shape[0] >= FEWEST_PASSES]
    if len(rows) < 4:
        return None
    centres, values, curves = (np.array([np.average(r[:, i], weights=r[:, 3]) for r in rows]) for i in range(3))
    spread = np.array([_half_width(r[:, 1]) for r in rows])
    whole = np.concatenate([each[good] for each, good in zip(law, okay, strict=True)])
    left = whole - np.interp(every, centres, curves)
    explained = 1.0 - float(left @ left) / max(float(np.sum((whole - whole.mean()) ** 2)), np.finfo(float).tiny)
    return Binned((centres, values, values - spread, values + spread, curves), explained)


def _edges(values: FloatArray, low: float, high: float) -> FloatArray:
    """Return bin edges, half as bins of one width would have them and half as bins of one count would."""
    grid = np.linspace(low, high, 20 * BINS + 1)
    counted = np.searchsorted(np.sort(values), grid) / values.size
    share = 0.5 * (grid - low) / (high - low) + 0.5 * (counted - counted[0]) / (counted[-1] - counted[0])
    return np.interp(np.linspace(0.0, 1.0, BINS + 1), share, grid)


def _half_width(values: FloatArray) -> float:
    """Return half the 95 % interval of a mean of passes."""
    count = values.size
    return float(stats.t.isf(0.025, count - 1) * np.std(values, ddof=1) / np.sqrt(count))


def _passes(bins: FloatArray, signals: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return the bin of each pass and the signals' means over it with its length, shapes (P,) and (P, 4)."""
    start = np.flatnonzero(np.diff(bins, prepend=bins[0] - 1))
    length = np.diff(np.append(start, bins.size)).astype(float)
    sums = [np.add.reduceat(each, start) / length for each in signals]
    return bins[start], np.stack([*sums, length], axis=1)
