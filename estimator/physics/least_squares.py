"""Bounded nonlinear least squares for long residuals and few unknowns: a projected Levenberg-Marquardt method.

``scipy.optimize.least_squares`` decomposes the whole Jacobian at every step; with ten thousand errors and twenty
unknowns that costs more than the simulations that made it. Here the step comes from the normal equations, with
Marquardt's scaling (SIAM J. Appl. Math. 11, 1963) and unknowns held at the bounds they press against (the active set
of Bertsekas, SIAM J. Control Optim. 20, 1982).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from estimator.signals.record import FloatArray

CONVERGED = 0.01
"""A step that promises less than this in log-likelihood ratio, ``n dS/S``, changes no conclusion: stop there."""

FIRST_DAMPING = 1e-3
EASE, STIFFEN = 0.2, 5.0
MOST_DAMPING = 1e9


@dataclass(frozen=True, slots=True)
class Solution:
    """Where a fit ended: unknowns (U,), errors (R,), Jacobian there (R, U)."""

    x: FloatArray
    residual: FloatArray
    jacobian: FloatArray
    converged: bool


def minimise(
    residual: Callable[[FloatArray], FloatArray],
    jacobian: Callable[[FloatArray], FloatArray],
    x0: FloatArray,
    low: FloatArray,
    high: FloatArray,
    iterations: int = 50,
) -> Solution:
    """Minimise ``sum(residual(x)**2)`` subject to ``low <= x <= high`` from one start.

    Parameters
    ----------
    residual, jacobian : callable
        Unknowns (U,) to errors (R,) and to their derivatives (R, U).
    iterations : int
        Jacobians at most; ``converged`` is False when they were used up.
    """
    x = np.clip(x0, low, high)
    errors = residual(x)
    damping = FIRST_DAMPING
    for _ in range(iterations):
        derivative = jacobian(x)
        gradient, curvature = derivative.T @ errors, derivative.T @ derivative
        square = float(errors @ errors)
        enough = CONVERGED * square / errors.size
        moved = False
        while damping < MOST_DAMPING and not moved:
            step = _step(x, gradient, curvature, damping, low, high)
            if -step @ (2.0 * gradient + curvature @ step) < enough:
                return Solution(x, errors, derivative, True)
            tried = residual(x + step)
            moved = float(tried @ tried) < square
            damping *= EASE if moved else STIFFEN
        if not moved:
            return Solution(x, errors, derivative, True)
        x, errors = x + step, tried
    return Solution(x, errors, jacobian(x), False)


def _step(
    x: FloatArray,
    gradient: FloatArray,
    curvature: FloatArray,
    damping: float,
    low: FloatArray,
    high: FloatArray,
) -> FloatArray:
    """Return the damped Gauss-Newton step, cut at the bounds; unknowns that meet one are held and the rest solved."""
    fixed = low == high
    held = fixed | ((x <= low) & (gradient > 0)) | ((x >= high) & (gradient < 0))
    down, up = (np.subtract(bound, x, out=np.zeros_like(x), where=~fixed) for bound in (low, high))  # may be infinite
    step = np.zeros_like(x)
    diagonal = np.diag(curvature)
    scale = damping * np.maximum(diagonal, 1e-12 * diagonal.max())
    while not held.all():
        free = ~held
        right = -gradient[free] - curvature[np.ix_(free, held)] @ step[held]
        step[free] = np.linalg.solve(curvature[np.ix_(free, free)] + np.diag(scale[free]), right)
        cut = np.clip(step, down, up)
        outside = free & (cut != step)
        step = cut
        if not outside.any():
            break
        held = held | outside
    return step
