"""A fit's problem: which unknowns, of which recordings, and the free run they give.

The error is ``simulated - measured`` over the unmasked samples of all recordings. Some unknowns all recordings share,
others are a recording's own and move it alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.physics.driveline import Case, InitialCondition
from estimator.physics.layout import LOAD, Grid, flat, grid_for, slot
from estimator.physics.model import DrivelineModel, Load
from estimator.physics.simulate import simulate_outputs, simulate_records
from estimator.physics.unknowns import LocalBasis, Shared, local_basis, own_unknowns, shared_load
from estimator.signals.record import BoolArray, FloatArray, IntArray, Record, leads, once

BAD = 1e3  # a simulation that runs away counts as this many times the largest output


Rows = slice | IntArray
"""Places of some samples among all that are stacked."""


@dataclass(frozen=True, slots=True)
class Problem:
    """What is fitted to what."""

    grid: Grid  # how it is integrated
    records: tuple[Record, ...]  # what the model has to follow
    p: FloatArray  # (layout.SIZE,): parameter vector
    shared: tuple[Shared, ...]  # unknowns that all recordings share
    local: tuple[LocalBasis, ...]  # what each recording has of its own
    use: tuple[BoolArray, ...]  # per recording, which samples count
    leads: tuple[int, ...] = ()  # which recording's own unknowns each recording has

    def __post_init__(self) -> None:
        if not self.leads:
            object.__setattr__(self, "leads", leads(self.records))

    @property
    def drives(self) -> tuple[tuple[int, ...], ...]:
        """Places of the outputs of each recording, which one simulation gives; first that of the recording itself."""
        firsts = sorted(set(self.leads))
        return tuple(tuple(i for i, lead in enumerate(self.leads) if lead == first) for first in firsts)

    @property
    def rows(self) -> list[Rows]:
        """Where the samples of each recording that count stand among all, its outputs in turn."""
        ends = np.cumsum([0, *(int(use.sum()) for use in self.use)])
        return [
            slice(ends[first], ends[first + 1])
            if not further
            else np.concatenate([np.arange(ends[i], ends[i + 1]) for i in (first, *further)])
            for first, *further in self.drives
        ]

    @property
    def bases(self) -> tuple[LocalBasis, ...]:
        """What recordings have of their own, in the order of the unknowns."""
        return tuple(basis for i, basis in enumerate(self.local) if self.leads[i] == i)


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

    ``own`` holds the own parameters of effects for each recording; by default those of the model's effects. A constant
    load torque that all recordings share is an unknown next to ``shared``; of one recording it is its own.
    """
    if own is None:
        own = [own_unknowns(model.effects, record) for record in records]
    if model.load is Load.SHARED and len(records) > 1 and not any(unknown.slot == slot("", LOAD) for unknown in shared):
        shared = (*shared, shared_load(model, records))
    has_own_load = model.load is Load.OWN or (model.load is Load.SHARED and len(records) == 1)
    effects = frozenset(model.effects) | {unknown.effect for unknown in shared}
    lead_of = leads(records)
    local = [
        local_basis(model, record, profile, mine, effects, has_own_load)
        for record, mine in zip(records, own, strict=True)
    ]
    return Problem(
        grid or grid_for(model, records),
        tuple(records),
        flat(model),
        tuple(shared),
        tuple(local[lead] for lead in lead_of),
        tuple(record.okay for record in records) if use is None else tuple(use),
        lead_of,
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
    first = len(problem.shared) + sum(basis.guess.size for basis in problem.local[: problem.leads[index]])
    return slice(first, first + problem.local[index].guess.size)


def bounds(problem: Problem) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper bounds of the scaled unknowns."""
    low = np.concatenate([np.array([s.low for s in problem.shared]), *(basis.low for basis in problem.bases)])
    high = np.concatenate([np.array([s.high for s in problem.shared]), *(basis.high for basis in problem.bases)])
    return low, high


def start_vector(problem: Problem) -> FloatArray:
    """Return where a fit starts without better knowledge."""
    return np.concatenate([np.array([s.start for s in problem.shared]), *(b.guess for b in problem.bases)])


def outputs_at(problem: Problem, x: FloatArray) -> tuple[FloatArray, ...]:
    """Simulate every recording at scaled unknowns ``x``."""
    p = parameters(problem, x)
    drives = problem.drives
    cases = [case_of(problem.local[drive[0]], p, local_part(problem, x, drive[0])) for drive in drives]
    runs = simulate_records(problem.grid, [[problem.records[i] for i in drive] for drive in drives], cases)
    found = {i: out for drive, run in zip(drives, runs, strict=True) for i, out in zip(drive, run, strict=True)}
    return tuple(_within_reason(found[i], record) for i, record in enumerate(problem.records))


def start_of(problem: Problem, x: FloatArray, index: int) -> InitialCondition:
    """Return load torque, as far as it is its own, and initial state of one recording."""
    return problem.local[index].start(local_part(problem, x, index))


def simulated_each(
    problem: Problem,
    points: Sequence[tuple[FloatArray, FloatArray]],
    index: int,
    alike_s: FloatArray | None = None,
) -> FloatArray:
    """Return the samples that count of one recording for parameter vectors and its own unknowns, shape (K, R_i)."""
    basis = problem.local[index]
    cases = [case_of(basis, p, local) for p, local in points]
    return simulated_cases(problem, cases, index, alike_s)


def simulated_cases(
    problem: Problem, cases: Sequence[Case], index: int, alike_s: FloatArray | None = None
) -> FloatArray:
    """Simulate the recordings of one drive in several cases at once; their used samples, shape (C, R)."""
    drive = problem.drives[index]
    records = [problem.records[i] for i in drive]
    outputs = simulate_outputs(problem.grid, records, cases, alike_s)
    return np.hstack(
        [_within_reason(outputs[:, place], problem.records[i])[:, problem.use[i]] for place, i in enumerate(drive)]
    )


def case_of(basis: LocalBasis, p: FloatArray, local: FloatArray) -> Case:
    """Return the simulation of a recording for a parameter vector and the recording's own unknowns."""
    return Case(basis.parameters(p, local), basis.start(local), basis.extra_load(local))


def _within_reason(out: FloatArray, record: Record) -> FloatArray:
    worst = far_away(record)
    if -worst <= out.min() and out.max() <= worst:  # False where it is no number
        return out
    return np.clip(np.nan_to_num(out, nan=worst), -worst, worst)


@once
def far_away(record: Record) -> float:
    """Return the size of an output that counts for one that has run away [unit of the output]."""
    return BAD * (float(np.abs(record.output[record.okay]).max()) or 1.0)


def _stack(problem: Problem, arrays: Sequence[FloatArray]) -> FloatArray:
    return np.concatenate([array[use] for array, use in zip(arrays, problem.use, strict=True)])


def residual_at(problem: Problem, outputs: Sequence[FloatArray]) -> FloatArray:
    """Return the errors of the samples that count, shape (R,)."""
    return _stack(problem, [out - record.output for out, record in zip(outputs, problem.records, strict=True)])
