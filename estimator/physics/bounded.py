"""The least of a quadratic inside bounds, from its triangular factor.

``scipy.optimize.lsq_linear`` (bounded-variable least squares: Stark and Parker, Computational Statistics 10, 1995)
decomposes a matrix once for every unknown that meets a bound. Most fits here end inside, and most unknowns have no
bounds: those follow from the others, and only what is bounded is left to it.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear

from estimator.signals.record import BoolArray, FloatArray, IntArray

TINY = 1e-12
"""Room that a bound always leaves: an interval of no length is none."""


def unbounded_first(low: FloatArray, high: FloatArray, among: BoolArray) -> IntArray:
    """Return the indices of some unknowns, those without any bound first; otherwise in order."""
    chosen = np.flatnonzero(among)
    return chosen[np.argsort(_bounded(low[chosen], high[chosen]), kind="stable")]


def least_inside(triangle: FloatArray, target: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the least of ``|triangle @ x - target|`` with ``low <= x <= high``, shape (U,).

    Parameters
    ----------
    triangle : ndarray, shape (U, U)
        Upper triangular, without a zero on its diagonal; unknowns without bounds first (``unbounded_first``).
    low, high : ndarray, shape (U,)
        ``low <= 0 <= high``, -inf and inf where there is no bound.
    """
    x: FloatArray = solve_triangular(triangle, target)
    if not np.any((x < low) | (x > high)):
        return x
    free = int(_bounded(low, high).argmax())
    rest = slice(free, None)
    inside = lsq_linear(triangle[rest, rest], target[rest], (low[rest], high[rest] + TINY), method="bvls").x
    x[rest] = np.clip(inside, low[rest], high[rest])
    if free:
        x[:free] = solve_triangular(triangle[:free, :free], target[:free] - triangle[:free, rest] @ x[rest])
    return x


def _bounded(low: FloatArray, high: FloatArray) -> BoolArray:
    bounded: BoolArray = np.isfinite(low) | np.isfinite(high)
    return bounded
