"""Derivatives of an output by differences: simulations with one unknown moved each, beside the one with none."""

from __future__ import annotations

import numpy as np

from estimator.compiled import compiled
from estimator.signals.record import BoolArray, FloatArray


@compiled
def differences(
    moved: FloatArray, output: FloatArray, use: BoolArray, steps: FloatArray, limit: float, least: float
) -> FloatArray:
    """Return the derivatives of the samples that count, shape (K, R) [unit of the output].

    Parameters
    ----------
    moved, output : ndarray, shape (K, N) and (N,)
        Simulations with unknown k moved by ``steps[k]``, and without [unit of the output].
    use : ndarray of bool, shape (N,)
        Which R samples count.
    steps : ndarray, shape (K,)
        In scaled unknowns, without unit.
    limit : float
        Size of a simulation beyond which it has run away; it is taken to stay there [unit of the output].
    least : float
        Largest change that is none: of rounding alone [unit of the output].
    """
    found = np.empty((moved.shape[0], int(np.sum(use))))
    for k in range(moved.shape[0]):
        row, largest = 0, 0.0
        for i in range(output.size):
            if use[i]:
                value = limit if np.isnan(moved[k, i]) else min(max(moved[k, i], -limit), limit)
                change = value - output[i]
                found[k, row] = change / steps[k]
                largest = max(largest, abs(change))
                row += 1
        if largest <= least:
            found[k] = 0.0
    return found
