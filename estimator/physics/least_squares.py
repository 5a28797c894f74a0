"""Bounded nonlinear least squares for long residuals and few unknowns: a projected Levenberg-Marquardt method.

``scipy.optimize.least_squares`` decomposes the whole Jacobian at every step; with ten thousand errors and twenty
unknowns that costs more than the simulations that made it. Here the step comes from the normal equations, with
Marquardt's scaling (SIAM J. Appl. Math. 11, 1963), and is the least of the damped quadratic inside the bounds
(`damped_step`). Near the end, where steps keep what they promise, the Jacobian is carried on by
Broyden's update (Math. Comp. 19, 1965; with Marquardt's method: Madsen, Nielsen and Tingleff, Methods for Non-Linear
Least Squares Problems, DTU 2004, 3.5): it costs a simulation per unknown, a step one. A fit ends a last small step from
a Jacobian found anew.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from estimator.compiled import compiled
from estimator.signals.correlation import effective_samples
from estimator.signals.record import BoolArray, FloatArray, IntArray

TINY = 1e-12  # room that a bound always leaves: an interval of no length is none
EXCHANGES = 10  # exchanges after which pivoting is taken to go round in circles

CONVERGED = 0.1
"""A step that promises less than this in log-likelihood ratio, ``n dS/S``, changes no conclusion: it is the last."""

MOST_AS_ONE = 30.0
"""Correlated errors of which one counts in n, at most.

What a wrong law leaves keeps its sign for long. Along a valley that leads nowhere its fit would continue for a part of
the error that chance alone moves further. But where all of the error is such, a plateau on the way looks like the end.
"""

RELIABLE = 0.75
"""Share of a step's promise that it must keep for the derivative to be carried on to the next and not found again."""

FAR = 0.2
"""Share of the squared error that such a step takes away at most: far from the end the derivative is soon another."""

FIRST_DAMPING = 1e-3
EASE, STIFFEN = 0.2, 5.0
LEAST_DAMPING, MOST_DAMPING = 1e-10, 1e9


def unbounded_first(low: FloatArray, high: FloatArray, among: BoolArray) -> IntArray:
    """Return the indices of some unknowns, those without any bound first; otherwise in order."""
    chosen = np.flatnonzero(among)
    return chosen[np.argsort(_bounded(low[chosen], high[chosen]), kind="stable")]


def least_inside(triangle: FloatArray, target: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the least of ``|triangle @ x - target|`` with ``low <= x <= high``, shape (U,)."""
    free = int(_bounded(low, high).argmax())
    x, ended = least(np.ascontiguousarray(triangle), target, low, high, free, EXCHANGES)
    if not ended:
        rest = slice(free, None)
        x[rest] = _one_by_one(triangle[rest, rest], target[rest], low[rest], high[rest])
        x[:free] = substituted(triangle[:free, :free], target[:free] - triangle[:free, rest] @ x[rest])
    return x


def least_of_quadratic(curvature: FloatArray, gradient: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the least of ``x' curvature x / 2 + gradient' x`` with ``low <= x <= high``, shape (U,)."""
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
    return np.isfinite(low) | np.isfinite(high)


@dataclass(frozen=True, slots=True)
class Solution:
    """Where a fit ended: unknowns (U,), errors (R,), Jacobian there, or one last small step before (R, U)."""

    x: FloatArray  # scaled, at the minimum
    residual: FloatArray  # errors there
    jacobian: FloatArray | None  # None where none was made
    converged: bool  # whether the last step promised too little to matter
    stuck: bool = False  # whether no step, however short, made the error smaller


def minimise(
    residual: Callable[[FloatArray], FloatArray],
    jacobian: Callable[[FloatArray], FloatArray],
    x0: FloatArray,
    low: FloatArray,
    high: FloatArray,
    iterations: int = 50,
    smooth: bool = True,
) -> Solution:
    """Minimise ``sum(residual(x)**2)`` subject to ``low <= x <= high`` from one start."""
    x = np.clip(x0, low, high)
    errors, damping = residual(x), FIRST_DAMPING
    for _ in range(iterations):
        derivative, fresh, refused = jacobian(x), True, False
        gradient, curvature = derivative.T @ errors, derivative.T @ derivative
        while True:
            square = float(errors @ errors)
            step = damped_step(x, gradient, curvature, damping, low, high)
            promise = float(-step @ (2.0 * gradient + curvature @ step))
            if _is_little(promise, square, errors):
                if not fresh:
                    break
                tried = residual(x + step)
                x, errors = (x + step, tried) if _gained(errors, tried) > 0.0 else (x, errors)
                return Solution(x, errors, derivative, True, stuck=refused)
            tried = residual(x + step)
            gained = _gained(errors, tried)
            if not gained > 0.0:
                if not fresh:
                    break
                damping, refused = damping * STIFFEN, True
                if damping >= MOST_DAMPING:
                    return Solution(x, errors, derivative, True, stuck=True)
                continue
            damping = max(damping * EASE, LEAST_DAMPING)
            change, fresh = tried - errors, False
            x, errors = x + step, tried
            if not (smooth and RELIABLE * promise <= gained < FAR * square):
                break
            derivative, curvature = _carried_on(derivative, curvature, change, step)
            gradient = derivative.T @ errors
    return Solution(x, errors, None, False)


def _is_little(promise: float, square: float, errors: FloatArray) -> bool:
    """Tell whether a fall of the squared error is too small to count, of errors that are partly independent."""
    least = CONVERGED * square / errors.size
    if not least <= promise < MOST_AS_ONE * least:
        return promise < least
    return promise < CONVERGED * square / effective_samples([errors])


def _gained(errors: FloatArray, tried: FloatArray) -> float:
    """Return by how much the squared error falls; a simulation that ran away has an infinite one."""
    with np.errstate(over="ignore"):
        return float(errors @ errors) - float(tried @ tried)


def _carried_on(
    derivative: FloatArray, curvature: FloatArray, change: FloatArray, step: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the nearest derivative that has the change of the errors over a step (Broyden), and its curvature."""
    missed = (change - derivative @ step) / (step @ step)
    across = np.outer(derivative.T @ missed, step)
    bent: FloatArray = curvature + across + across.T + (missed @ missed) * np.outer(step, step)
    return (derivative.T + np.outer(step, missed)).T, bent


def damped_step(
    x: FloatArray,
    gradient: FloatArray,
    curvature: FloatArray,
    damping: float,
    low: FloatArray,
    high: FloatArray,
) -> FloatArray:
    """Return the step (U,) that minimises the damped quadratic inside the bounds."""
    free = unbounded_first(low, high, low < high)
    diagonal = np.diag(curvature)
    damped = curvature + np.diag(damping * np.maximum(diagonal, 1e-12 * diagonal.max()))
    down, up = low[free] - x[free], high[free] - x[free]
    step = np.zeros_like(x)
    step[free] = least_of_quadratic(
        damped[np.ix_(free, free)], gradient[free], np.minimum(down, 0.0), np.maximum(up, 0.0)
    )
    return step
