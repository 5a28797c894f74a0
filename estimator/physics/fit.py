"""Fit of the free-run simulation: least squares over shared parameters and each recording's own unknowns."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from estimator.physics.effect import MOMENTS
from estimator.physics.jacobian import jacobian_at
from estimator.physics.least_squares import Solution, minimise
from estimator.physics.problem import (
    Problem,
    bounds,
    local_part,
    outputs_at,
    parameters,
    residual_at,
    start_vector,
)
from estimator.physics.problem import make_problem as make_problem  # where users have always found it
from estimator.signals.record import BoolArray, FloatArray

ITERATIONS = 50
"""Jacobians at most; a fit that needs more is not converged."""

MOMENT_NAMES = frozenset(moment.name for moment in MOMENTS)
"""Names of an event's own unknowns: the error over them has a kink at every sample's edge."""


@dataclass(frozen=True, slots=True)
class FitResult:
    """A fit: unknowns, simulations, errors and their Jacobian.

    Attributes
    ----------
    x : ndarray, shape (U,)
        Scaled unknowns.
    outputs : tuple of ndarray, shape (N_i,)
        Simulated output of each recording, every sample.
    residual : ndarray, shape (R,)
        Errors of the samples that count.
    derivative : ndarray, shape (R, U), or None
        Derivative of the errors by the scaled unknowns; None where it was let go.
    converged : bool
        False where the iteration limit ended the fit.
    """

    problem: Problem
    x: FloatArray
    outputs: tuple[FloatArray, ...]
    residual: FloatArray
    derivative: FloatArray | None
    converged: bool

    @property
    def jacobian(self) -> FloatArray:
        """Derivative of the errors by the scaled unknowns, shape (R, U); found again where it was let go."""
        if self.derivative is None:
            return jacobian_at(self.problem, self.x, self.outputs)
        return self.derivative

    def light(self) -> FitResult:
        """Return this fit without its derivative, which of long recordings takes most of its room."""
        return replace(self, derivative=None)

    def first_outputs(self) -> FitResult:
        """Return this fit of the recordings' first outputs alone; it has the same unknowns."""
        problem, count = self.problem, len(self.problem.bases)
        if count == len(problem.records):
            return self
        rows = slice(0, sum(int(use.sum()) for use in problem.use[:count]))
        first = replace(
            problem,
            records=problem.records[:count],
            local=problem.local[:count],
            use=problem.use[:count],
            leads=problem.leads[:count],
        )
        derivative = None if self.derivative is None else self.derivative[rows]
        outputs = self.outputs[:count]
        return replace(self, problem=first, outputs=outputs, residual=self.residual[rows], derivative=derivative)

    @property
    def squares(self) -> float:
        """Sum of the squared errors of the samples that count."""
        return float(self.residual @ self.residual)

    @property
    def rms(self) -> float:
        """RMS of the free-run error over the samples that count."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @property
    def p(self) -> FloatArray:
        """Parameter vector of the fit, shape (layout.SIZE,)."""
        return parameters(self.problem, self.x)

    @property
    def pinned(self) -> BoolArray:
        """Which unknowns ended at a bound, shape (U,)."""
        low, high = bounds(self.problem)
        fixed = low == high  # at infinity, too
        down, up = (np.subtract(self.x, bound, out=np.zeros_like(self.x), where=~fixed) for bound in (low, high))
        ended: BoolArray = fixed | (down < 1e-6) | (-up < 1e-6)
        return ended

    @property
    def free_count(self) -> int:
        """How many unknowns the fit could change."""
        low, high = bounds(self.problem)
        return int(np.sum(low < high))

    def value(self, effect: str, name: str) -> float:
        """Fitted value of a parameter (``effect`` empty for a nominal one)."""
        return float(self.p[next(s.slot for s in self.problem.shared if (s.effect, s.name) == (effect, name))])

    def values_of(self, effect: str) -> dict[str, float]:
        """Return the values of an effect's parameters that all recordings share."""
        return {
            s.name: float(x) * s.scale for s, x in zip(self.problem.shared, self.x, strict=False) if s.effect == effect
        }

    def p_of(self, index: int) -> FloatArray:
        """Parameter vector of one recording, its own parameters among them; shape (layout.SIZE,)."""
        return self.problem.local[index].parameters(self.p, self.local_of(index))

    def local_of(self, index: int) -> FloatArray:
        """Scaled unknowns of one recording."""
        return local_part(self.problem, self.x, index)


def not_fitted(problem: Problem, x: FloatArray) -> FitResult:
    """Return the free run at scaled unknowns ``x`` as a fit that has not begun."""
    outputs = outputs_at(problem, x)
    return FitResult(problem, x, outputs, residual_at(problem, outputs), None, False)


def _moments(problem: Problem) -> BoolArray:
    """Return which unknowns are moments of events, shape (U,)."""
    parts = [np.zeros(len(problem.shared), dtype=bool)]
    for basis in problem.bases:
        own = np.zeros(basis.guess.size, dtype=bool)
        own[basis.own_rows] = [unknown.name in MOMENT_NAMES for unknown in basis.own]
        parts.append(own)
    return np.concatenate(parts)


def fit(problem: Problem, x0: FloatArray | None = None, iterations: int = ITERATIONS) -> FitResult:
    """Minimise the squared free-run error from one start.

    Parameters
    ----------
    x0 : ndarray, shape (U,), optional
        Scaled start; ``start_vector`` by default.
    iterations : int
        Jacobians at most.
    """
    low, high = bounds(problem)
    seen: dict[bytes, tuple[FloatArray, ...]] = {}

    def outputs(x: FloatArray) -> tuple[FloatArray, ...]:
        key = x.tobytes()
        if key not in seen:
            seen.clear()
            seen[key] = outputs_at(problem, x)
        return seen[key]

    def least(x: FloatArray, low: FloatArray, high: FloatArray) -> Solution:
        return minimise(
            lambda x: residual_at(problem, outputs(x)),
            lambda x: jacobian_at(problem, x, outputs(x)),
            x,
            low,
            high,
            iterations,
            smooth=not moments.any(),
        )

    moments = _moments(problem)
    solution = least(start_vector(problem) if x0 is None else x0, low, high)
    if solution.stuck and moments.any():  # at a kink over a moment every step is refused: first without them
        x = solution.x
        x = least(x, np.where(moments, x, low), np.where(moments, x, high)).x
        solution = least(x, low, high)
    return FitResult(problem, solution.x, outputs(solution.x), solution.residual, solution.jacobian, solution.converged)
