"""The least of a quadratic inside bounds.

Most fits here end inside, and most unknowns have no bounds: those follow from the others. What is bounded is put on its
bounds and taken off them by block principal pivoting (Portugal, Judice and Vicente, Mathematics of Computation 63,
1994), all that is on the wrong side at once. That is over after a few exchanges and may, rarely, go round in circles:
then ``scipy.optimize.lsq_linear`` (Stark and Parker, Computational Statistics 10, 1995) takes one unknown at a time.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import lsq_linear

from estimator.compiled import compiled
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
    free = int(_bounded(low, high).argmax())
    x, ended = least(np.ascontiguousarray(triangle), target, low, high, free, EXCHANGES)
    if not ended:
        rest = slice(free, None)
        x[rest] = _one_by_one(triangle[rest, rest], target[rest], low[rest], high[rest])
        x[:free] = substituted(triangle[:free, :free], target[:free] - triangle[:free, rest] @ x[rest])
    return x


def least_of_quadratic(curvature: FloatArray, gradient: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the least of ``x' curvature x / 2 + gradient' x`` with ``low <= x <= high``, shape (U,).

    ``curvature``, shape (U, U), is positive definite; unknowns without bounds come first, as in ``least_inside``.
    """
    return least_inside(*_factored(curvature, gradient), low, high)


@compiled
def _factored(curvature: FloatArray, gradient: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return triangle and target of a quadratic: its least is that of ``|triangle @ x - target|``."""
    lower = np.linalg.cholesky(curvature)
    target = np.empty_like(gradient)
    for i in range(target.size):
        left = -gradient[i]
        for j in range(i):
            left -= lower[i, j] * target[j]
        target[i] = left / lower[i, i]
    return np.ascontiguousarray(lower.T), target


@compiled
def least(
    triangle: FloatArray, target: FloatArray, low: FloatArray, high: FloatArray, free: int, exchanges: int
) -> tuple[FloatArray, bool]:
    """Return the least and whether pivoting came to an end, of unknowns of which the first ``free`` have no bounds."""
    x = substituted(triangle, target)
    if not np.any((x < low) | (x > high)):
        return x, True
    rest = np.ascontiguousarray(triangle[free:, free:])
    x[free:], ended = _pivoted(rest, target[free:], low[free:], high[free:], exchanges)
    across = np.ascontiguousarray(triangle[:free, free:])
    x[:free] = substituted(triangle[:free, :free], target[:free] - across @ x[free:])
    return x, ended


@compiled
def substituted(triangle: FloatArray, target: FloatArray) -> FloatArray:
    """Return x with ``triangle @ x = target``, of an upper triangle."""
    x = np.empty_like(target)
    for i in range(x.size - 1, -1, -1):
        left = target[i]
        for j in range(i + 1, x.size):
            left -= triangle[i, j] * x[j]
        x[i] = left / triangle[i, i]
    return x


@compiled
def _pivoted(
    triangle: FloatArray, target: FloatArray, low: FloatArray, high: FloatArray, exchanges: int
) -> tuple[FloatArray, bool]:
    """Return the least by block principal pivoting, and whether that came to an end."""
    curvature, slope = triangle.T @ triangle, triangle.T @ target
    down, up, x = np.zeros(low.size, np.bool_), np.zeros(low.size, np.bool_), np.zeros(low.size)
    for _ in range(exchanges):
        free = ~(down | up)
        x = np.where(down, low, np.where(up, high, 0.0))
        which = np.flatnonzero(free)
        if which.size > 0:
            x[which] = np.linalg.lstsq(triangle[:, which], target - triangle @ x)[0]  # two may be alike
        pull = slope - curvature @ x  # where the error would fall
        inward = (down & (pull > 0.0)) | (up & (pull < 0.0))
        below, above = free & (x < low), free & (x > high)
        if not np.any(inward | below | above):
            return x, True
        down, up = (down & ~inward) | below, (up & ~inward) | above
    return x, False


def _one_by_one(triangle: FloatArray, target: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    inside: FloatArray = lsq_linear(triangle, target, (low, high + TINY), method="bvls").x
    return np.clip(inside, low, high)


def _bounded(low: FloatArray, high: FloatArray) -> BoolArray:
    bounded: BoolArray = np.isfinite(low) | np.isfinite(high)
    return bounded
