"""Gauss-Newton descent of the squared innovations, with derivatives that are carried from fit to fit.

A derivative by differences costs a simulation per unknown, a step one. So a fit begins with the derivative of the fit
it extends, of which only the new unknowns' columns are found, and follows it by Broyden's update (Math. Comp. 19,
1965; with Marquardt's damping: Madsen, Nielsen and Tingleff, Methods for Non-Linear Least Squares Problems, DTU 2004,
3.5). It is found anew where a step does not keep what it promised, and before a fit counts as ended. Derivatives are
those of the plain errors: they hold under any weighting.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.thresholds import Fitting
from estimator.least_squares import damped_step
from estimator.physics.fit import FitResult, in_common
from estimator.physics.jacobian import jacobian_at
from estimator.physics.problem import Problem, bounds, outputs_at, residual_at
from estimator.signals.record import FloatArray

Weigh = Callable[[FloatArray], FloatArray]

FIRST_DAMPING = 1e-3
EASE, STIFFEN = 0.2, 5.0
LEAST_DAMPING, MOST_DAMPING = 1e-10, 1e8

MUCH_BYTES = 2**25  # room of a derivative that is rather found again than kept with a fit that is over


@dataclass(frozen=True, slots=True)
class Effort:
    """How much a descent may cost: derivatives found anew, and steps."""

    derivatives: int  # how often they are found anew at most
    steps: int  # at most


def extended(problem: Problem, x: FloatArray, previous: FitResult, anew: str = "") -> FitResult:
    """Return the free run of a problem at ``x`` with the derivative of a fit with which it has unknowns in common.

    The columns of the others are found, and those of the parameters of an effect that is begun ``anew``.
    """
    low, high = bounds(problem)
    x = np.clip(x, low, high)
    outputs = outputs_at(problem, x)
    initial = FitResult(problem, x, outputs, residual_at(problem, outputs), None, False)
    if previous.derivative is None or previous.derivative.shape[0] != initial.residual.size:
        return initial
    columns, taken, ratio = in_common(problem, previous.problem)
    known = previous.derivative[:, taken].any(axis=0)  # what was held there, and is free here, is not known
    known &= ~np.isin(columns, [i for i, shared in enumerate(problem.shared) if anew and shared.effect == anew])
    columns, taken, ratio = columns[known], taken[known], ratio[known]
    new = low < high
    new[columns] = False
    derivative = jacobian_at(problem, x, outputs, new) if new.any() else np.zeros((initial.residual.size, x.size))
    derivative[:, columns] = previous.derivative[:, taken] * (ratio * (low < high)[columns])
    return replace(initial, derivative=derivative)


def without_derivative(fit: FitResult) -> FitResult:
    """Return a fit that is over, without a derivative that takes much room."""
    return fit if fit.derivative is None or fit.derivative.nbytes <= MUCH_BYTES else fit.without_derivative()


def descended(initial: FitResult, weigh: Weigh, effort: Effort) -> FitResult:
    """Return the unknowns at which the squared innovations under fixed disturbances are least."""
    descent = _Descent(initial, weigh, effort.derivatives)
    for _ in range(effort.steps):
        if not descent.step():
            break
    return descent.result


class _Descent:
    """One descent: where it is, its derivative, how it is damped, and what it may still spend."""

    def __init__(self, initial: FitResult, weigh: Weigh, derivatives: int) -> None:
        self._problem, self._weigh, self._left = initial.problem, weigh, derivatives
        self._low, self._high = bounds(initial.problem)
        self._x = np.clip(initial.x, self._low, self._high)
        self._outputs, self._errors, self._derivative = initial.outputs, initial.residual, initial.derivative
        self._innovations = weigh(self._errors)
        self._fresh = initial.converged and initial.derivative is not None
        self._damping, self._converged = FIRST_DAMPING, False

    @property
    def result(self) -> FitResult:
        return FitResult(self._problem, self._x, self._outputs, self._errors, self._derivative, self._converged)

    def step(self) -> bool:
        """Take a step, and tell whether there may be another."""
        derivative = self._found_derivative()
        if derivative is None:
            return False
        white = self._weigh(derivative)
        gradient, curvature = white.T @ self._innovations, white.T @ white
        while True:
            moved = damped_step(self._x, gradient, curvature, self._damping, self._low, self._high)
            promise = float(-moved @ (2.0 * gradient + curvature @ moved))
            if promise < Fitting.LITTLE:
                self._converged = self._fresh
                return not self._fresh and self._find_derivative()
            gained = self._try(moved)
            if gained > 0.0:
                self._damping = max(self._damping * EASE, LEAST_DAMPING)
                self._fresh = self._fresh and Fitting.LEAST_SHARE_OF_PROMISE * promise <= gained < Fitting.NEAR
                return gained >= Fitting.LEAST_SHARE_OF_PROMISE * promise or self._left == 0 or self._find_derivative()
            if not self._fresh:
                return self._find_derivative()
            self._damping *= STIFFEN
            if self._damping >= MOST_DAMPING:
                self._converged = True
                return False

    def _found_derivative(self) -> FloatArray | None:
        if self._derivative is None:
            self._find_derivative()
        return self._derivative

    def _find_derivative(self) -> bool:
        if self._left == 0:
            return False
        self._left -= 1
        self._derivative, self._fresh = jacobian_at(self._problem, self._x, self._outputs), True
        return True

    def _try(self, moved: FloatArray) -> float:
        """Go there where the squared innovations fall, carry the derivative along, and return by how much they fall."""
        x = self._x + moved
        outputs = outputs_at(self._problem, x)
        errors = residual_at(self._problem, outputs)
        innovations = self._weigh(errors)
        with np.errstate(over="ignore"):
            gained = float(self._innovations @ self._innovations) - float(innovations @ innovations)
        if gained > 0.0 and self._derivative is not None:
            missed = (errors - self._errors - self._derivative @ moved) / (moved @ moved)
            self._derivative = self._derivative + np.outer(missed, moved)
            self._x, self._outputs, self._errors, self._innovations = x, outputs, errors, innovations
        return gained
