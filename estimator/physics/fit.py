"""Fit of the free-run simulation: least squares over shared parameters and each recording's own unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from estimator.least_squares import Solution, minimise
from estimator.physics.effect import MOMENTS
from estimator.physics.jacobian import jacobian_at
from estimator.physics.model import Structure
from estimator.physics.parallel import concurrently
from estimator.physics.problem import (
    Problem,
    bounds,
    local_part,
    make_problem as make_problem,  # where users have always found it
    outputs_at,
    parameters,
    residual_at,
    start_vector,
)
from estimator.signals.record import BoolArray, FloatArray, IntArray

ITERATIONS = 50  # jacobians at most; a fit that needs more is not converged

MOMENT_NAMES = frozenset(moment.name for moment in MOMENTS)
"""Names of an event's own unknowns: the error over them has a kink at every sample's edge."""

HEAT = 3  # jacobians that each of several starts gets before only the best ones continue
CONTINUED_RATIO = 1.1  # squared error, over the best start's, up to which a start continues


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

    problem: Problem  # what was fitted
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

    def without_derivative(self) -> FitResult:
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
        return fixed | (down < 1e-6) | (-up < 1e-6)

    def value(self, effect: str, name: str) -> float:
        """Fitted value of a parameter (``effect`` empty for a nominal one)."""
        return float(self.p[next(s.slot for s in self.problem.shared if (s.effect, s.name) == (effect, name))])

    def values_of(self, effect: str) -> dict[str, float]:
        """Return the fitted values of an effect, in its parameters' units."""
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


Name = tuple[object, ...]


def best_fit(problems: Sequence[Problem], previous: FitResult | None = None) -> FitResult:
    """Fit from several starts and return the best; what a fit ``warm`` has in common starts where that one ended."""
    if len(problems) == 1:
        return _initial_fit(problems[0], previous, ITERATIONS)
    heat = initial_fits(problems, previous, HEAT)
    finals = concurrently(converge, [heat[i] for i in close(heat)])
    return min(finals, key=lambda result: result.squares)


def initial_fits(
    problems: Sequence[Problem], previous: FitResult | None = None, iterations: int = HEAT
) -> list[FitResult]:
    """Fit a few steps from each of several starts."""
    return concurrently(partial(_initial_fit, previous=previous, iterations=iterations), problems)


def close(heat: Sequence[FitResult]) -> list[int]:
    """Return which of several fits are close to the best, that first; the others were tried in vain."""
    least = min(result.squares for result in heat)
    order = sorted(range(len(heat)), key=lambda i: heat[i].squares)
    return [i for i in order if heat[i].squares <= CONTINUED_RATIO * least]


def converge(result: FitResult) -> FitResult:
    """Continue with a fit that its iteration limit ended."""
    return result if result.converged else fit(result.problem, result.x)


def _initial_fit(problem: Problem, previous: FitResult | None, iterations: int) -> FitResult:
    return fit(problem, None if previous is None else warm_start(problem, previous), iterations)


def warm_start(problem: Problem, previous: FitResult) -> FloatArray:
    """Return scaled unknowns, shape (U,): where a fit left them, and those that it lacks where a fit starts."""
    x = start_vector(problem)
    columns, taken, ratio = in_common(problem, previous.problem)
    x[columns] = previous.x[taken] / ratio
    return x


def in_common(problem: Problem, other: Problem) -> tuple[IntArray, IntArray, FloatArray]:
    """Return where the unknowns that two problems have in common stand in each, and the ratio of their scales."""
    place = {name: column for column, name in enumerate(_names(other))}
    pairs = [(column, place[name]) for column, name in enumerate(_names(problem)) if name in place]
    columns, taken = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    return columns, taken, _scales(problem)[columns] / _scales(other)[taken]


def _names(problem: Problem) -> list[Name]:
    """Return what tells each unknown from all others."""
    names: list[Name] = [(shared.effect, shared.name) for shared in problem.shared]
    for i, basis in enumerate(problem.bases):
        names += [(i, row) for row in range(basis.own_rows.start)]
        names += [(i, own.effect, own.name) for own in basis.own]
        names += [(i, *basis.profile.shape, row) for row in range(basis.profile.shape[0])]
    return names


def _scales(problem: Problem) -> FloatArray:
    return np.concatenate([[shared.scale for shared in problem.shared], *(basis.scale for basis in problem.bases)])


def rates(result: FitResult) -> list[FloatArray]:
    """Return the rate of each recording's output at its samples [output unit / s]."""
    if result.problem.grid.structure is Structure.JOINT:
        pairs = zip(result.outputs, result.problem.records, strict=True)
        return [_secants(output, record.sample_time_s) for output, record in pairs]
    at, before, after = (_sampled(result, periods) for periods in (0.0, -1.0, 1.0))
    return [
        _both_sides(now - was, will_be - now) / record.sample_time_s
        for now, was, will_be, record in zip(at, before, after, result.problem.records, strict=True)
    ]


def _sampled(result: FitResult, periods: float) -> tuple[FloatArray, ...]:
    """Return the outputs, each followed along its tangent for so many sampling periods."""
    problem = result.problem
    moved = [replace(r, offset_s=np.full(r.output.shape, periods * r.sample_time_s)) for r in problem.records]
    return outputs_at(replace(problem, records=tuple(moved)), result.x)


def _secants(output: FloatArray, sample_time_s: float) -> FloatArray:
    steps = np.diff(output) / sample_time_s
    return _both_sides(np.append(0.0, steps), np.append(steps, steps[-1:]))


def _both_sides(before: FloatArray, after: FloatArray) -> FloatArray:
    return np.stack([np.append(after[:1], before[1:]), after])
