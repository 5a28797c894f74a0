"""Bounded nonlinear least squares for long residuals and few unknowns: a projected Levenberg-Marquardt method.

``scipy.optimize.least_squares`` decomposes the whole Jacobian at every step; with ten thousand errors and twenty
unknowns that costs more than the simulations that made it. Here the step comes from the normal equations, with
Marquardt's scaling (SIAM J. Appl. Math. 11, 1963), and is the least of the damped quadratic inside the bounds
(``estimator.physics.bounded``). Near the end, where steps keep what they promise, the Jacobian is carried on by
Broyden's update (Math. Comp. 19, 1965; with Marquardt's method: Madsen, Nielsen and Tingleff, Methods for Non-Linear
Least Squares Problems, DTU 2004, 3.5): it costs a simulation per unknown, a step one. A fit ends a last small step from
a Jacobian found anew.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from estimator.physics.bounded import least_of_quadratic, unbounded_first
from estimator.signals.correlation import effective_samples
from estimator.signals.record import FloatArray

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


@dataclass(frozen=True, slots=True)
class Solution:
    """Where a fit ended: unknowns (U,), errors (R,), Jacobian there, or one last small step before (R, U).

    No Jacobian where the iterations were used up: whoever continues finds it, and few do.
    ``stuck`` where a step was refused and shorter ones promised nothing any more, or were refused as well: the error
    has a kink there, or ``x`` is its least to the last digits.
    """

    x: FloatArray
    residual: FloatArray
    jacobian: FloatArray | None
    converged: bool
    stuck: bool = False


def minimise(
    residual: Callable[[FloatArray], FloatArray],
    jacobian: Callable[[FloatArray], FloatArray],
    x0: FloatArray,
    low: FloatArray,
    high: FloatArray,
    iterations: int = 50,
    smooth: bool = True,
) -> Solution:
    """Minimise ``sum(residual(x)**2)`` subject to ``low <= x <= high`` from one start.

    Parameters
    ----------
    residual, jacobian : callable
        Unknowns (U,) to errors (R,), in the order of time (one recording after the other), and to their derivatives
        (R, U).
    iterations : int
        Jacobians at most; ``converged`` is False when they were used up.
    smooth : bool
        False where the errors have kinks, over which no Jacobian is carried on.
    """
    x = np.clip(x0, low, high)
    errors, damping = residual(x), FIRST_DAMPING
    for _ in range(iterations):
        derivative, fresh, refused = jacobian(x), True, False
        gradient, curvature = derivative.T @ errors, derivative.T @ derivative
        while True:
            square = float(errors @ errors)
            step = _step(x, gradient, curvature, damping, low, high)
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
    """Return the derivative nearest to the old one that tells the change of the errors over a step, and its curvature.

    The derivative changes by what has rank one, the curvature by a little more: much less work than a product anew.
    """
    missed = (change - derivative @ step) / (step @ step)
    across = np.outer(derivative.T @ missed, step)
    bent: FloatArray = curvature + across + across.T + (missed @ missed) * np.outer(step, step)
    return (derivative.T + np.outer(step, missed)).T, bent


def _step(
    x: FloatArray,
    gradient: FloatArray,
    curvature: FloatArray,
    damping: float,
    low: FloatArray,
    high: FloatArray,
) -> FloatArray:
    """Return the damped Gauss-Newton step inside the bounds: the least of the damped quadratic there."""
    free = unbounded_first(low, high, low < high)
    diagonal = np.diag(curvature)
    damped = curvature + np.diag(damping * np.maximum(diagonal, 1e-12 * diagonal.max()))
    down, up = low[free] - x[free], high[free] - x[free]
    step = np.zeros_like(x)
    step[free] = least_of_quadratic(
        damped[np.ix_(free, free)], gradient[free], np.minimum(down, 0.0), np.maximum(up, 0.0)
    )
    return step
