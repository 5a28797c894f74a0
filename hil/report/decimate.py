"""Thin a trace for drawing: the lowest and the highest sample of every stretch stay, no peak is lost."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimator.signals.record import FloatArray


def extremes(y: FloatArray, stretches: int) -> NDArray[np.intp]:
    """Choose which samples of a trace to draw.

    Parameters
    ----------
    y : ndarray, shape (N,)
        The trace; NaN is a gap.
    stretches : int
        Number of stretches; each keeps two samples at most. A trace that is short enough is kept whole.

    Returns
    -------
    ndarray of int, shape (K,)
        Increasing sample numbers. A stretch that is a gap keeps its first sample, so that the gap is drawn.
    """
    n = y.shape[0]
    if n <= 2 * stretches:
        return np.arange(n)
    length = -(-n // stretches)
    padded = np.full(stretches * length, np.nan)
    padded[:n] = y
    rows = padded.reshape(stretches, length)
    first = np.arange(stretches) * length
    lowest = first + np.argmin(np.where(np.isnan(rows), np.inf, rows), axis=1)
    highest = first + np.argmax(np.where(np.isnan(rows), -np.inf, rows), axis=1)
    chosen = np.unique(np.concatenate([[0, n - 1], lowest, highest]))
    kept: NDArray[np.intp] = chosen[chosen < n]
    return kept
