"""Fit of the free-run simulation: least squares over shared parameters and each recording's own unknowns.

The error is ``simulated - measured`` over the unmasked samples of all recordings. A local unknown moves its own
recording only, so one simulation of every recording gives a column of the Jacobian for all of them at once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.abreast import LANES
from estimator.physics.differences import differences
from estimator.physics.effect import MOMENTS
from estimator.physics.grid import Grid, grid_for
from estimator.physics.layout import flat
from estimator.physics.least_squares import Solution, minimise
from estimator.physics.model import DrivelineModel
from estimator.physics.parallel import WORKERS, concurrently
from estimator.physics.simulate import Case, simulate_each, simulate_records
from estimator.physics.start import Start
from estimator.physics.unknowns import LocalBasis, Shared, local_basis, own_unknowns
from estimator.signals.record import BoolArray, FloatArray, IntArray, Record

STEP = 1e-5
"""Finite-difference step in scaled unknowns: the simulation is smooth to about 1e-10 of its size."""

ROUNDING = 1e-13
"""Change of the output, over its size, that is none: simulations side by side round otherwise than one by itself, and
an unknown that does nothing, such as the phase of an amplitude that is 0, has a column of zeros."""

ITERATIONS = 50
"""Jacobians at most; a fit that needs more is not converged."""

BAD = 1e3
"""A simulation that runs away counts as this many times the largest output."""

MOMENT_NAMES = frozenset(moment.name for moment in MOMENTS)
"""Names of an event's own unknowns: the error over them has a kink at every sample's edge."""


@dataclass(frozen=True, slots=True)
class Problem:
    """What is fitted to what.

    Attributes
    ----------
    p : ndarray, shape (layout.SIZE,)
        Parameter vector; unknowns overwrite their slots.
    use : tuple of ndarray of bool
        Per recording, which samples count.
    """

    grid: Grid
    records: tuple[Record, ...]
    p: FloatArray
    shared: tuple[Shared, ...]
    local: tuple[LocalBasis, ...]
    use: tuple[BoolArray, ...]


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


def make_problem(
    model: DrivelineModel,
    records: Sequence[Record],
    shared: Sequence[Shared],
    *,
    own: Sequence[tuple[Shared, ...]] | None = None,
    profile: bool = False,
    use: Sequence[BoolArray] | None = None,
    grid: Grid | None = None,
) -> Problem:
    """Set up a fit of ``shared`` and every recording's own unknowns, from a model's values and effects.

    ``own`` holds the own parameters of effects for each recording; by default those of the model's effects.
    """
    if own is None:
        own = [own_unknowns(model.effects, record) for record in records]
    effects = frozenset(model.effects) | {unknown.effect for unknown in shared}
    return Problem(
        grid or grid_for(model, records),
        tuple(records),
        flat(model),
        tuple(shared),
        tuple(local_basis(model, record, profile, mine, effects) for record, mine in zip(records, own, strict=True)),
        tuple(record.okay for record in records) if use is None else tuple(use),
    )


def parameters(problem: Problem, x: FloatArray) -> FloatArray:
    """Return the kernel's parameter vector for scaled unknowns ``x``."""
    p = problem.p.copy()
    for value, unknown in zip(x, problem.shared, strict=False):
        p[unknown.slot] = unknown.scale * value
    return p


def local_part(problem: Problem, x: FloatArray, index: int) -> FloatArray:
    """Return the scaled unknowns of one recording."""
    return x[own_part(problem, index)]


def own_part(problem: Problem, index: int) -> slice:
    """Return where the unknowns of one recording stand among all."""
    first = len(problem.shared) + sum(basis.guess.size for basis in problem.local[:index])
    return slice(first, first + problem.local[index].guess.size)


def bounds(problem: Problem) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper bounds of the scaled unknowns."""
    low = np.concatenate([np.array([s.low for s in problem.shared]), *(basis.low for basis in problem.local)])
    high = np.concatenate([np.array([s.high for s in problem.shared]), *(basis.high for basis in problem.local)])
    return low, high


def start_vector(problem: Problem) -> FloatArray:
    """Return where a fit starts without better knowledge."""
    return np.concatenate([np.array([s.start for s in problem.shared]), *(b.guess for b in problem.local)])


def outputs_at(problem: Problem, x: FloatArray) -> tuple[FloatArray, ...]:
    """Simulate every recording at scaled unknowns ``x``."""
    p = parameters(problem, x)
    cases = [_case(basis, p, local_part(problem, x, i)) for i, basis in enumerate(problem.local)]
    outputs = simulate_records(problem.grid, problem.records, cases)
    return tuple(_within_reason(out, record) for out, record in zip(outputs, problem.records, strict=True))


def start_of(problem: Problem, x: FloatArray, index: int) -> Start:
    """Return load torque and initial state of one recording."""
    return problem.local[index].start(local_part(problem, x, index))


def simulated_each(
    problem: Problem,
    points: Sequence[tuple[FloatArray, FloatArray]],
    index: int,
    alike_s: FloatArray | None = None,
) -> FloatArray:
    """Return the outputs of one recording for parameter vectors and the recording's own unknowns, shape (K, N).

    ``alike_s``, shape (K,), tells up to when each is as the first one (``simulate.simulate_each``).
    """
    record, basis = problem.records[index], problem.local[index]
    cases = [_case(basis, p, local) for p, local in points]
    return _within_reason(simulate_each(problem.grid, record, cases, alike_s=alike_s), record)


def _case(basis: LocalBasis, p: FloatArray, local: FloatArray) -> Case:
    return Case(basis.parameters(p, local), basis.start(local), basis.extra_load(local))


def _within_reason(out: FloatArray, record: Record) -> FloatArray:
    """Return outputs (..., N) of a recording, far away where the simulation runs away."""
    worst = _far_away(record)
    if -worst <= out.min() and out.max() <= worst:  # False where it is no number
        return out
    return np.clip(np.nan_to_num(out, nan=worst), -worst, worst)


def _far_away(record: Record) -> float:
    """Return the size of an output that counts for one that has run away [unit of the output]."""
    return BAD * (float(np.abs(record.output[record.okay]).max()) or 1.0)


def not_fitted(problem: Problem, x: FloatArray) -> FitResult:
    """Return the free run at scaled unknowns ``x`` as a fit that has not begun."""
    outputs = outputs_at(problem, x)
    return FitResult(problem, x, outputs, residual_at(problem, outputs), None, False)


def _stack(problem: Problem, arrays: Sequence[FloatArray]) -> FloatArray:
    return np.concatenate([array[use] for array, use in zip(arrays, problem.use, strict=True)])


def residual_at(problem: Problem, outputs: Sequence[FloatArray]) -> FloatArray:
    """Return the errors of the samples that count, shape (R,)."""
    return _stack(problem, [out - record.output for out, record in zip(outputs, problem.records, strict=True)])


def jacobian_at(problem: Problem, x: FloatArray, outputs: Sequence[FloatArray]) -> FloatArray:
    """Return the derivative of the errors by the scaled unknowns, shape (R, U), by differences inside the bounds.

    It is 0 by what can't change.
    """
    low, high = bounds(problem)
    columns = [_moving(problem, low < high, i) for i in range(len(problem.records))]
    parts = [(i, part) for i, mine in enumerate(columns) for part in np.array_split(mine, _parts(mine.size))]
    rows = np.cumsum([0, *(int(use.sum()) for use in problem.use)])
    jacobian = np.zeros((x.size, rows[-1])).T  # filled column by column

    def fill(work: tuple[int, IntArray]) -> None:
        i, mine = work
        jacobian[rows[i] : rows[i + 1], mine] = changes(problem, x, i, mine, outputs[i])

    concurrently(fill, [work for work in parts if work[1].size])
    return jacobian


def _parts(columns: int) -> int:
    """Return into how many parts so many columns are cut: enough for both cores, none wider than the lanes."""
    return max(WORKERS, math.ceil(columns / LANES))


def changes(problem: Problem, x: FloatArray, index: int, columns: IntArray, output: FloatArray) -> FloatArray:
    """Return the derivative of one recording's errors by some of the scaled unknowns, shape (R_i, columns.size)."""
    _, high = bounds(problem)
    steps = np.where(x + STEP <= high, STEP, -STEP)[columns]
    record, cases = problem.records[index], _moved_cases(problem, x, index, columns, steps)
    moved = simulate_each(problem.grid, record, cases)
    least = ROUNDING * float(np.abs(output).max())
    return differences(moved, output, problem.use[index], steps, _far_away(record), least).T


def _moved_cases(problem: Problem, x: FloatArray, index: int, columns: IntArray, steps: FloatArray) -> list[Case]:
    """Return the simulations of one recording with some of the scaled unknowns moved, each by its step."""
    basis, p, mine = problem.local[index], parameters(problem, x), own_part(problem, index)
    case = _case(basis, p, x[mine])
    cases = []
    for j, step in zip(columns.tolist(), steps.tolist(), strict=True):
        if j < len(problem.shared):
            unknown, moved_p = problem.shared[j], case.p.copy()
            moved_p[unknown.slot] = unknown.scale * (x[j] + step)
            cases.append(replace(case, p=moved_p))
        else:
            local = x[mine].copy()
            local[j - mine.start] += step
            cases.append(_case(basis, p, local))
    return cases


def _moving(problem: Problem, free: BoolArray, index: int) -> IntArray:
    """Return which of the free unknowns move one recording: those of all, and its own."""
    moving = free.copy()
    moving[len(problem.shared) :] = False
    moving[own_part(problem, index)] = free[own_part(problem, index)]
    return np.flatnonzero(moving)


def _moments(problem: Problem) -> BoolArray:
    """Return which unknowns are moments of events, shape (U,)."""
    parts = [np.zeros(len(problem.shared), dtype=bool)]
    for basis in problem.local:
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
