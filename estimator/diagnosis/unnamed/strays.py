"""Single readings that are off by far: wrong bits on the way from the sensor, which no motion of the line explains."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import stats
from scipy.ndimage import maximum_filter1d, median_filter

from estimator.signals.record import BoolArray, FloatArray

NEIGHBOURS = 7
"""A reading is held against the median of so many around it: a swing of the line lasts longer."""

FALSE_ALARM = 0.01
"""Probability that normal noise makes one stray in all recordings."""

WITHIN = 0.9
"""Share of the values from which their spread is estimated: few of those are their neighbours' median, none a stray."""


def strays(errors: Sequence[FloatArray]) -> list[BoolArray]:
    """Tell which values of an error stand out of their neighbours, per recording; shapes (B_i,)."""
    apart = [apart_from_neighbours(error) for error in errors]
    every = np.concatenate(apart)
    sigma = float(np.quantile(np.abs(every), WITHIN)) / float(stats.norm.isf(0.5 * (1.0 - WITHIN)))
    limit = float(stats.norm.isf(0.5 * FALSE_ALARM / every.size)) * sigma
    return [np.abs(each) > limit for each in apart]


def apart_from_neighbours(error: FloatArray) -> FloatArray:
    """Return how far each value is from its neighbours' median; 0 at the ends, with neighbours on one side only."""
    apart: FloatArray = error - median_filter(error, NEIGHBOURS, mode="nearest")
    ends = NEIGHBOURS // 2
    apart[:ends] = apart[-ends:] = 0.0
    return apart


def near(off: BoolArray) -> BoolArray:
    """Tell which values stand next to one that is off, shape (B,): a filter answers to it for some samples."""
    found: BoolArray = maximum_filter1d(off.astype(np.int8), NEIGHBOURS, mode="constant").astype(np.bool_)
    return found
