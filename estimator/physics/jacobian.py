"""The Jacobian of a free run by differences: a simulation with each unknown moved.

Next to the derivative at a point there is the one over a width (`secants_at`): where a law switches, the free run has
kinks at every moment at which it does, and the slope between two of them says nothing of the next ones.

A local unknown moves its own recording only. Recordings that can be simulated as if they were one fill the lanes of
the kernel together: each has some dozen unknowns, which leave lanes empty where it goes alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.compiled import compiled
from estimator.lanes import LANES
from estimator.physics.driveline import Case
from estimator.physics.parallel import concurrently
from estimator.physics.problem import Problem, bounds, case_of, far_away, local_part, own_part, parameters
from estimator.physics.simulate import are_of_a_length, go_together, lanes_filled, simulate_outputs, simulate_together
from estimator.physics.unknowns import Shared
from estimator.signals.record import BoolArray, FloatArray, IntArray

STEP = 1e-5  # finite-difference step in scaled unknowns: the simulation is smooth to about 1e-10 of its size

ROUNDING = 1e-13
"""Change of the output, over its size, that is none: simulations side by side round otherwise than one by itself, and
an unknown that does nothing, such as the phase of an amplitude that is 0, has a column of zeros."""

ROOM = 2**20  # values of simulations that are made at a time, where they are more than fill the lanes


@compiled
def fill_differences(
    moved: FloatArray,
    of: IntArray,
    outputs: FloatArray,
    use: BoolArray,
    steps: FloatArray,
    limits: FloatArray,
    least: FloatArray,
    columns: IntArray,
    firsts: IntArray,
    found: FloatArray,
) -> None:
    """Fill in the derivatives of the samples that count."""
    for k, c in np.ndindex(of.shape):
        i = of[k, c]
        row, largest = firsts[i], 0.0
        for n in range(outputs.shape[1]):
            if use[i, n]:
                value = limits[i] if np.isnan(moved[k, c, n]) else min(max(moved[k, c, n], -limits[i]), limits[i])
                change = value - outputs[i, n]
                found[columns[k], row] = change / steps[k]
                largest = max(largest, abs(change))
                row += 1
        if largest <= least[i]:
            found[columns[k], firsts[i] : row] = 0.0


@dataclass(frozen=True, slots=True)
class _Moved:
    """K simulations with one unknown moved each."""

    of: IntArray  # (K,), recording of each simulation
    columns: IntArray  # (K,), unknown that was moved

    def part(self, rows: slice) -> _Moved:
        """Return some of them."""
        return _Moved(self.of[rows], self.columns[rows])


def jacobian_at(
    problem: Problem,
    x: FloatArray,
    outputs: Sequence[FloatArray],
    among: BoolArray | None = None,
    steps: FloatArray | None = None,
) -> FloatArray:
    """Return the derivative of the errors by the scaled unknowns, shape (R, U), by differences inside the bounds.

    It is 0 by what can't change, and by what is not ``among`` those asked for, shape (U,). ``steps``, of that shape,
    are by how much each is moved; `STEP` by default.
    """
    low, high = bounds(problem)
    wanted = (low < high) if among is None else (low < high) & among
    moving = [np.flatnonzero(_moves(problem, wanted, drive[0])) for drive in problem.drives]
    around = _Around(problem, x, outputs, problem.drives, steps)
    parts = _together(problem, moving) if around.is_one else _separately(moving)
    found = np.zeros((x.size, around.firsts[-1]))
    concurrently(lambda part: around.fill(part, found), parts)
    return found.T


def secants_at(problem: Problem, x: FloatArray, outputs: Sequence[FloatArray], widths: FloatArray) -> FloatArray:
    """Return the slope of the errors over so much of each scaled unknown to both sides, shape (R, U).

    ``widths`` is of shape (U,), above 0. A bound cuts a side off: beyond it there is nothing to be said.
    """
    low, high = bounds(problem)
    free = low < high  # what is held may be at infinity, as the limit of an inverter that has none
    low, high, at = (np.where(free, each, 0.0) for each in (low, high, x))
    up, down = np.minimum(widths, high - at), np.minimum(widths, at - low)
    both = np.maximum(up + down, STEP)
    found = np.zeros((sum(int(use.sum()) for use in problem.use), x.size))
    for side, steps in ((up, up), (down, -down)):
        moved = side > 0.0
        found += jacobian_at(problem, x, outputs, moved, np.where(moved, steps, STEP)) * (side / both)
    return found


def changes(
    problem: Problem, x: FloatArray, index: int, columns: IntArray, outputs: Sequence[FloatArray]
) -> FloatArray:
    """Return the derivative of one recording's errors by some of the scaled unknowns, shape (R_i, columns.size)."""
    around = _Around(problem, x, outputs, problem.drives)
    found = np.zeros((x.size, around.firsts[-1]))
    around.fill(_Moved(np.full(columns.size, index), columns), found)
    return found[columns][:, problem.rows[index]].T


def _moves(problem: Problem, free: BoolArray, index: int) -> BoolArray:
    """Tell which of the free unknowns move one recording: those of all, and its own; shape (U,)."""
    moves = np.zeros_like(free)
    for mine in (slice(0, len(problem.shared)), own_part(problem, index)):
        moves[mine] = free[mine]
    return moves


def _separately(moving: Sequence[IntArray]) -> list[_Moved]:
    """Return parts of one drive each: two at least, none wider than the lanes."""
    return [
        _Moved(np.full(some.size, i), some)
        for i, mine in enumerate(moving)
        for some in np.array_split(mine, max(2, math.ceil(mine.size / LANES)))
        if some.size
    ]


def _together(problem: Problem, moving: Sequence[IntArray]) -> list[_Moved]:
    of = np.repeat(np.arange(len(moving)), [mine.size for mine in moving])
    columns = np.concatenate(moving)
    own = columns >= len(problem.shared)
    place = columns - np.where(own, [own_part(problem, problem.drives[i][0]).start for i in of.tolist()], 0)
    order = np.lexsort((of, place, own))
    everything = _Moved(of[order], columns[order])
    longest = max(record.time_s.size for record in problem.records)
    return [everything.part(rows) for rows in lanes_filled(of.size, max(ROOM // (LANES * longest), 1))]


class _Around:
    """The free runs around a point: each differs from the one there by one unknown.

    ``drives`` holds the places of outputs that one simulation gives.
    """

    def __init__(
        self,
        problem: Problem,
        x: FloatArray,
        outputs: Sequence[FloatArray],
        drives: Sequence[tuple[int, ...]],
        steps: FloatArray | None = None,
    ) -> None:
        self._problem, self._x = problem, x
        _, high = bounds(problem)
        self._steps = np.where(x + STEP <= high, STEP, -STEP) if steps is None else steps
        p = parameters(problem, x)
        self._members = drives
        self._drives = [[problem.records[i] for i in drive] for drive in drives]
        self._cases = [case_of(problem.local[i], p, local_part(problem, x, i)) for i, *_ in drives]
        shape = (len(outputs), max(output.size for output in outputs))
        self._outputs, self._use = np.zeros(shape), np.zeros(shape, dtype=bool)
        for i, (output, use) in enumerate(zip(outputs, problem.use, strict=True)):
            self._outputs[i, : output.size], self._use[i, : use.size] = output, use
        self._limits = np.array([far_away(record) for record in problem.records])
        self.firsts = np.concatenate([[0], np.cumsum(self._use.sum(axis=1))])

    @property
    def is_one(self) -> bool:
        problem = self._problem
        if len(self._drives) == 1 or not are_of_a_length(self._drives):
            return False
        moved = {unknown.slot for unknown in (*problem.shared, *(own for basis in problem.local for own in basis.own))}
        return go_together(problem.grid, self._drives, [case.p for case in self._cases], sorted(moved))

    def fill(self, moved: _Moved, found: FloatArray) -> None:
        """Fill in derivatives: a row of all samples that count for each unknown, shape (U, R)."""
        grid, drives = self._problem.grid, self._drives
        of, columns, steps = moved.of, moved.columns, self._steps[moved.columns]
        cases = [self._case(i, j) for i, j in zip(of.tolist(), columns.tolist(), strict=True)]
        if (of == of[0]).all():
            out = simulate_outputs(grid, drives[of[0]], cases)
        else:
            out = simulate_together(grid, drives, of.tolist(), cases)
        members = np.array([self._members[i] for i in of])
        least = ROUNDING * np.abs(self._outputs).max(axis=1)
        known = self._outputs, self._use, steps, self._limits, least, columns, self.firsts
        fill_differences(out, members, *known, found)

    def _case(self, drive: int, column: int) -> Case:
        """Return the simulation of a drive with one of the scaled unknowns moved by its step."""
        problem, case, index = self._problem, self._cases[drive], self._members[drive][0]
        basis = problem.local[index]
        moved = float(self._x[column] + self._steps[column])
        own = column - own_part(problem, index).start
        if column < len(problem.shared):
            return _with(case, problem.shared[column], moved)
        if own < basis.own_rows.start:
            local = local_part(problem, self._x, index).copy()
            local[own] = moved
            return replace(case, start=basis.start(local))
        if own < basis.own_rows.stop:
            return _with(case, basis.own[own - basis.own_rows.start], moved)
        more_nm = self._steps[column] * basis.scale[own] * basis.profile[own - basis.profile_rows.start]
        return replace(case, extra_load_nm=more_nm if case.extra_load_nm is None else case.extra_load_nm + more_nm)


def _with(case: Case, unknown: Shared, x: float) -> Case:
    """Return a simulation with another value of one parameter, scaled."""
    p = case.p.copy()
    p[unknown.slot] = unknown.scale * x
    return replace(case, p=p)
