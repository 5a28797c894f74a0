"""Fit of the free-run simulation: least squares over shared parameters and each recording's own unknowns.

The error is ``simulated - measured`` over the unmasked samples of all recordings. A local unknown moves its own
recording only, so one simulation of every recording gives a column of the Jacobian for all of them at once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from typing import TypeVar

import numpy as np

from estimator.physics.layout import flat
from estimator.physics.least_squares import minimise
from estimator.physics.model import DrivelineModel
from estimator.physics.simulate import Grid, Start, grid_for, simulate
from estimator.physics.unknowns import LocalBasis, Shared, local_basis
from estimator.signals.record import BoolArray, FloatArray, Record

STEP = 1e-5
"""Finite-difference step in scaled unknowns: the simulation is smooth to about 1e-10 of its size."""

WORKERS = 2
BAD = 1e3
"""A simulation that runs away counts as this many times the output's range wrong."""

Item = TypeVar("Item")
Result = TypeVar("Result")


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
    jacobian : ndarray, shape (R, U)
        Derivative of the errors by the scaled unknowns.
    converged : bool
        False where the iteration limit ended the fit.
    """

    problem: Problem
    x: FloatArray
    outputs: tuple[FloatArray, ...]
    residual: FloatArray
    jacobian: FloatArray
    converged: bool

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
        return (self.x - low < 1e-6) | (high - self.x < 1e-6)

    def value(self, effect: str, name: str) -> float:
        """Fitted value of a parameter (``effect`` empty for a nominal one)."""
        return float(self.p[next(s.slot for s in self.problem.shared if (s.effect, s.name) == (effect, name))])

    def local_of(self, index: int) -> FloatArray:
        """Scaled unknowns of one recording."""
        return local_part(self.problem, self.x, index)


def make_problem(
    model: DrivelineModel,
    records: Sequence[Record],
    shared: Sequence[Shared],
    *,
    profile: bool = False,
    use: Sequence[BoolArray] | None = None,
    grid: Grid | None = None,
) -> Problem:
    """Set up a fit of ``shared`` and every recording's own unknowns, from a model's values and effects."""
    return Problem(
        grid or grid_for(model, records),
        tuple(records),
        flat(model),
        tuple(shared),
        tuple(local_basis(model, record, profile) for record in records),
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
    first = len(problem.shared) + sum(basis.guess.size for basis in problem.local[:index])
    return x[first : first + problem.local[index].guess.size]


def bounds(problem: Problem) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper bounds of the scaled unknowns."""
    free = sum(basis.guess.size for basis in problem.local)
    low = np.array([s.low for s in problem.shared] + [-np.inf] * free)
    high = np.array([s.high for s in problem.shared] + [np.inf] * free)
    return low, high


def start_vector(problem: Problem) -> FloatArray:
    """Return where a fit starts without better knowledge."""
    return np.concatenate([np.array([s.start for s in problem.shared]), *(b.guess for b in problem.local)])


def outputs_at(problem: Problem, x: FloatArray) -> tuple[FloatArray, ...]:
    """Simulate every recording at scaled unknowns ``x``."""
    p = parameters(problem, x)
    return tuple(_simulate_one(problem, p, local_part(problem, x, i), i) for i in range(len(problem.records)))


def start_of(problem: Problem, x: FloatArray, index: int) -> Start:
    """Return load torque and initial state of one recording."""
    return problem.local[index].start(local_part(problem, x, index))


def _simulate_one(problem: Problem, p: FloatArray, local: FloatArray, index: int) -> FloatArray:
    record, basis = problem.records[index], problem.local[index]
    out = simulate(problem.grid, record, p, basis.start(local), basis.extra_load(local))
    if np.isfinite(out).all():
        return out
    worst = BAD * float(np.ptp(record.output[record.okay]))
    return np.nan_to_num(out, nan=worst, posinf=worst, neginf=-worst)


def _stack(problem: Problem, arrays: Sequence[FloatArray]) -> FloatArray:
    return np.concatenate([array[use] for array, use in zip(arrays, problem.use, strict=True)])


def residual_at(problem: Problem, outputs: Sequence[FloatArray]) -> FloatArray:
    """Return the errors of the samples that count, shape (R,)."""
    return _stack(problem, [out - record.output for out, record in zip(outputs, problem.records, strict=True)])


@cache
def _pool() -> ThreadPoolExecutor:
    """Return the threads that simulate; the compiled kernel holds no interpreter lock."""
    return ThreadPoolExecutor(WORKERS, thread_name_prefix="driveline")


def _parallel(function: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    return list(_pool().map(function, items))


def jacobian_at(problem: Problem, x: FloatArray, outputs: Sequence[FloatArray]) -> FloatArray:
    """Return the derivative of the errors by the scaled unknowns, shape (R, U), by differences inside the bounds."""
    base = _stack(problem, outputs)
    _, high = bounds(problem)
    n_shared = len(problem.shared)

    def shared_column(j: int) -> FloatArray:
        step = STEP if x[j] + STEP <= high[j] else -STEP
        moved = x.copy()
        moved[j] += step
        column: FloatArray = (_stack(problem, outputs_at(problem, moved)) - base) / step
        return column

    rows = np.cumsum([0, *(int(use.sum()) for use in problem.use)])
    jacobian = np.zeros((base.size, x.size))
    jacobian[:, :n_shared] = np.array(_parallel(shared_column, range(n_shared))).T.reshape(base.size, n_shared)
    p = parameters(problem, x)

    def local_block(i: int) -> FloatArray:
        local = local_part(problem, x, i)
        columns = []
        for step in STEP * np.eye(local.size):
            moved = _simulate_one(problem, p, local + step, i)
            columns.append((moved - outputs[i])[problem.use[i]] / STEP)
        return np.array(columns).T

    first = n_shared
    for i, block in enumerate(_parallel(local_block, range(len(problem.records)))):
        jacobian[rows[i] : rows[i + 1], first : first + block.shape[1]] = block
        first += block.shape[1]
    return jacobian


def fit(problem: Problem, x0: FloatArray | None = None) -> FitResult:
    """Minimise the squared free-run error from one start.

    Parameters
    ----------
    x0 : ndarray, shape (U,), optional
        Scaled start; ``start_vector`` by default.
    """
    low, high = bounds(problem)
    seen: dict[bytes, tuple[FloatArray, ...]] = {}

    def outputs(x: FloatArray) -> tuple[FloatArray, ...]:
        key = x.tobytes()
        if key not in seen:
            seen.clear()
            seen[key] = outputs_at(problem, x)
        return seen[key]

    solution = minimise(
        lambda x: residual_at(problem, outputs(x)),
        lambda x: jacobian_at(problem, x, outputs(x)),
        start_vector(problem) if x0 is None else x0,
        low,
        high,
    )
    return FitResult(problem, solution.x, outputs(solution.x), solution.residual, solution.jacobian, solution.converged)


def best_fit(problems: Sequence[Problem], warm: FitResult | None = None) -> FitResult:
    """Fit from several starts and return the best; nominal and local unknowns start where ``warm`` ended."""
    results = [fit(problem, None if warm is None else _warm_start(problem, warm)) for problem in problems]
    return min(results, key=lambda result: float(result.residual @ result.residual))


def _warm_start(problem: Problem, warm: FitResult) -> FloatArray:
    known: Mapping[tuple[str, str], float] = {
        (s.effect, s.name): s.scale * x for s, x in zip(warm.problem.shared, warm.x, strict=False)
    }
    shared = np.array([known.get((s.effect, s.name), s.scale * s.start) / s.scale for s in problem.shared])
    local = []
    for i, basis in enumerate(problem.local):
        x = basis.guess.copy()
        old = warm.local_of(i)
        common = min(old.size, x.size)
        x[:common] = old[:common] * warm.problem.local[i].scale[:common] / basis.scale[:common]
        local.append(x)
    return np.concatenate([shared, *local])
