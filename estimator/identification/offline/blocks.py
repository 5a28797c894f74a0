"""Means over blocks of samples: where recordings are faster than the driveline, their error is judged by these.

The mean of k samples of ``y = G u + e`` is an equation as exact as each of them, so the model keeps the recording's own
period and its torque stays held; only what is left is thinned. A mean of k readings is the best use of white noise.
"""

from __future__ import annotations

import math

import numpy as np

from estimator.signals.part import sliced
from estimator.signals.record import BoolArray, FloatArray, Record

RASTER_S = 0.01
"""Longest block [s]: its means see up to 50 Hz, the upper end of the paper's band for driveline resonances."""


MOST = 60_000
"""Blocks that off-line models are fitted to, ten minutes at 10 ms: they know a resonance to a few parts in 100,000, and
a longer recording is of a driveline that warms meanwhile. Each costs 6 kilobytes."""


def first_part(record: Record) -> Record:
    """Return the part of a recording that off-line models are fitted to: the first MOST blocks."""
    most = MOST * block_of(record.sample_time_s)
    return record if record.time_s.shape[0] <= most else sliced(record, slice(0, most))


def block_of(sample_time_s: float) -> int:
    """Return how many samples of a period [s] make a block."""
    return max(1, math.floor(RASTER_S / sample_time_s * (1.0 + 1e-6)))


class Blocks:
    """Means over whole blocks, of the measured samples of each; what is left over at the end is not used.

    Parameters
    ----------
    okay : ndarray of bool, shape (N,)
        Which samples were measured.
    size : int
        Samples of a block.
    """

    def __init__(self, okay: BoolArray, size: int) -> None:
        self._size, self._n = size, okay.shape[0] // size
        self._good = okay[: self._n * size].reshape(self._n, size)
        self.okay: BoolArray = 2 * self._good.sum(axis=1) >= size
        """Blocks of which half or more was measured, shape (n,)."""

    def mean(self, x: FloatArray) -> FloatArray:
        """Return the means of x, shape (N,) or (N, m): shape (n,) or (n, m), 0 where a block is not okay."""
        good = self._good.reshape(self._n, self._size, *(1,) * (x.ndim - 1))
        parts = x[: self._n * self._size].reshape(self._n, self._size, *x.shape[1:])
        count = np.maximum(good.sum(axis=1), 1)
        means = np.where(good, parts, 0.0).sum(axis=1) / count
        means[~self.okay] = 0.0
        return np.asarray(means, dtype=np.float64)
