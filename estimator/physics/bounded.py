"""The least of a quadratic inside bounds, from its triangular factor.

Most fits here end inside, and most unknowns have no bounds: those follow from the others. What is bounded is put on its
bounds and taken off them by block principal pivoting (Portugal, Judice and Vicente, Mathematics of Computation 63,
1994), all that is on the wrong side at once. That is over after a few exchanges and may, rarely, go round in circles:
then ``scipy.optimize.lsq_linear`` (Stark and Parker, Computational Statistics 10, 1995) takes one unknown at a time.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear

from estimator.signals.record import BoolArray, FloatArray, IntArray

TINY = 1e-12
"""Room that a bound always leaves: an interval of no length is none."""

EXCHANGES = 10
"""Exchanges after which pivoting is taken to go round in circles."""


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
    bounded = (triangle[rest, rest], target[rest], low[rest], high[rest])
    inside = _pivoted(*bounded)
    x[rest] = _one_by_one(*bounded) if inside is None else inside
    if free:
        x[:free] = solve_triangular(triangle[:free, :free], target[:free] - triangle[:free, rest] @ x[rest])
    return x


def _pivoted(triangle: FloatArray, target: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray | None:
    """Return the least by block principal pivoting; None where it does not come to an end."""
    curvature, slope = triangle.T @ triangle, triangle.T @ target
    down, up = np.zeros_like(low, dtype=bool), np.zeros_like(low, dtype=bool)
    for _ in range(EXCHANGES):
        x = np.where(down, low, np.where(up, high, 0.0))
        free = ~(down | up)
        if free.any():
            x[free] = np.linalg.lstsq(triangle[:, free], target - triangle[:, ~free] @ x[~free])[0]  # two may be alike
        pull = slope - curvature @ x  # where the error would fall
        inward = (down & (pull > 0.0)) | (up & (pull < 0.0))
        below, above = free & (x < low), free & (x > high)
        if not (inward | below | above).any():
            return x
        down, up = (down & ~inward) | below, (up & ~inward) | above
    return None


def _one_by_one(triangle: FloatArray, target: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    inside: FloatArray = lsq_linear(triangle, target, (low, high + TINY), method="bvls").x
    return np.clip(inside, low, high)


def _bounded(low: FloatArray, high: FloatArray) -> BoolArray:
    bounded: BoolArray = np.isfinite(low) | np.isfinite(high)
    return bounded
