"""Moments of events: where else in a recording the innovations are less.

The squared innovations have a minimum near every edge that an event may begin or end at, and a descent finds the
nearest. So the likelihood is looked at elsewhere in the whole recording, all else as a fit has it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from estimator.diagnosis.inference.disturbances import Whitener
from estimator.diagnosis.thresholds import Fitting
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import MOMENT_NAMES, FitResult
from estimator.physics.jacobian import changes
from estimator.physics.problem import Problem, own_part, simulated_each
from estimator.physics.unknowns import LocalBasis
from estimator.signals.record import FloatArray, Record

OFFSETS_S = np.array([0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.6, 1.2, 2.4, 5.0, 10.0])
OFFSETS_S = np.concatenate([-OFFSETS_S[::-1], OFFSETS_S])
"""Where else the likelihood is looked at, around the moment a fit ended at; and at the recording's own ends."""


def with_better_moments(result: FitResult, filtered: Whitener) -> tuple[Problem, FloatArray] | None:
    """Return a problem and its unknowns with moments where the innovations are less; None where they are nowhere.

    A fit may move them from there as far as it could before.
    """
    problem, x, better = result.problem, result.x.copy(), False
    bases = list(problem.local)
    for i, basis in enumerate(problem.bases):
        local = _moved_in(result, filtered, i)
        if local is not None:
            x[own_part(problem, i)], better = local, True
            bases[i] = _around(basis, local, problem.records[i])
    return (replace(problem, local=tuple(bases[lead] for lead in problem.leads)), x) if better else None


def _around(basis: LocalBasis, local: FloatArray, record: Record) -> LocalBasis:
    """Return a basis with the bounds of movable moments as wide as before, around where they are."""
    first, last = (float(each) for each in record.since_start_s[[0, -1]])
    last += record.sample_time_s
    own = []
    for row, unknown in enumerate(basis.own, start=basis.own_rows.start):
        if EFFECTS[unknown.effect].event and unknown.low < unknown.high:
            at, reach = float(local[row]), 0.5 * (unknown.high - unknown.low)
            unknown = replace(unknown, start=at, low=max(first, at - reach), high=min(last, at + reach))
        own.append(unknown)
    return replace(basis, own=tuple(own))


def _moved_in(result: FitResult, filtered: Whitener, index: int) -> FloatArray | None:
    basis, local = result.problem.local[index], result.local_of(index).copy()
    ends = _ends(basis)
    if not ends:
        return None
    taken_up = _initial_state(result, filtered, index)
    began = best = float(_squares(result, filtered, index, taken_up, [local])[0])
    first, last = (float(each) for each in result.problem.records[index].since_start_s[[0, -1]])
    for begin, end in ends:
        may_move = [row for row in (begin, end) if basis.low[row] < basis.high[row]]
        sets = [[row] for row in may_move] + ([may_move] if len(may_move) > 1 else [])
        for _ in range(Fitting.MOVES):
            tried = [_shifted(local, rows, offset) for rows in sets for offset in OFFSETS_S]
            tried += [_shifted(local, [row], {begin: first, end: last}[row] - local[row]) for row in may_move]
            tried = [each for each in tried if first <= each[begin] <= each[end] <= max(last, local[end])]
            if not tried:
                break
            squares = _squares(result, filtered, index, taken_up, tried)
            if squares.min() >= best:
                break
            best, local = float(squares.min()), tried[int(squares.argmin())]
    return local if best < began - Fitting.WORTH_MOVING else None


def _shifted(local: FloatArray, rows: list[int], offset_s: float) -> FloatArray:
    x = local.copy()
    x[rows] += offset_s
    return x


def _ends(basis: LocalBasis) -> list[tuple[int, int]]:
    """Return where beginning and end of each event stand among a recording's unknowns."""
    place = {(u.effect, u.name): row for row, u in enumerate(basis.own, start=basis.own_rows.start)}
    movable = {u.effect for u in basis.own if EFFECTS[u.effect].event and u.low < u.high}
    return [(place[effect, "from_s"], place[effect, "to_s"]) for effect in sorted(movable)]


def _initial_state(result: FitResult, filtered: Whitener, index: int) -> FloatArray:
    """Return an orthonormal basis of what load torque and initial state do to the innovations."""
    first = own_part(result.problem, index).start
    columns = np.arange(first, first + result.problem.local[index].own_rows.start)
    return np.linalg.qr(filtered.part(index, changes(result.problem, result.x, index, columns, result.outputs)))[0]


def _squares(
    result: FitResult, filtered: Whitener, index: int, taken_up: FloatArray, tried: list[FloatArray]
) -> FloatArray:
    """Return the squared innovations for each of several vectors that differ in moments, shape (K,)."""
    problem = result.problem
    measured = np.concatenate([problem.records[i].output[problem.use[i]] for i in problem.drives[index]])
    outputs = simulated_each(problem, [(result.p, x) for x in tried], index)
    errors = filtered.part(index, (outputs - measured).T).T
    return (errors**2).sum(axis=1) - ((errors @ taken_up) ** 2).sum(axis=1)


def has_moments(problem: Problem) -> bool:
    """Tell whether a fit may move the moment of an event."""
    return any(u.name in MOMENT_NAMES and u.low < u.high for basis in problem.bases for u in basis.own)


def idle_moments(result: FitResult) -> int:
    """Return how many moments are of events that do not take place in their recording."""
    count = 0
    for i, basis in enumerate(result.problem.bases):
        values = result.local_of(i)[basis.own_rows]
        own = {(u.effect, u.name): (u, float(v)) for u, v in zip(basis.own, values, strict=True)}
        for name in {u.effect for u in basis.own if EFFECTS[u.effect].event}:
            (begin, from_s), (end, to_s) = own[name, "from_s"], own[name, "to_s"]
            movable = (begin.low < begin.high) + (end.low < end.high)
            if to_s <= from_s:
                count += movable
            else:  # one that begins or ends with the recording has no moment there
                first, last = (float(t) for t in result.problem.records[i].since_start_s[[0, -1]])
                count += (begin.low < begin.high and from_s <= first) + (end.low < end.high and to_s >= last)
    return count
