"""Derivatives of an output by differences: simulations with one unknown moved each, next to the one with none."""

from __future__ import annotations

import numpy as np

from estimator.compiled import compiled
from estimator.signals.record import BoolArray, FloatArray, IntArray


@compiled
def fill_differences(
    moved: FloatArray,
    of: IntArray,
    outputs: FloatArray,
    use: BoolArray,
    steps: FloatArray,
    limits: FloatArray,
    least: FloatArray,
    columns: IntArray,
    firsts: IntArray,
    found: FloatArray,
) -> None:
    """Fill in the derivatives of the samples that count.

    Parameters
    ----------
    moved : ndarray, shape (K, C, N)
        Outputs of simulations with one unknown moved each [units of the outputs].
    of : ndarray of int, shape (K, C)
        Which of the I each output is.
    outputs, use : ndarray, shape (I, N)
        Of every output the simulation without [unit of the output], and which samples count.
    steps : ndarray, shape (K,)
        By how much it is moved, in scaled unknowns, without unit.
    limits, least : ndarray, shape (I,)
        Size of a simulation beyond which it has run away, and is taken to stay there; largest change that is none, but
        of rounding alone [unit of the output].
    columns : ndarray of int, shape (K,)
        Which unknown is moved.
    firsts : ndarray of int, shape (I,)
        Where the samples of each output begin among all that count.
    found : ndarray, shape (U, R)
        A row per unknown.
    """
    for k, c in np.ndindex(of.shape):
        i = of[k, c]
        row, largest = firsts[i], 0.0
        for n in range(outputs.shape[1]):
            if use[i, n]:
                value = limits[i] if np.isnan(moved[k, c, n]) else min(max(moved[k, c, n], -limits[i]), limits[i])
                change = value - outputs[i, n]
                found[columns[k], row] = change / steps[k]
                largest = max(largest, abs(change))
                row += 1
        if largest <= least[i]:
            found[columns[k], firsts[i] : row] = 0.0
