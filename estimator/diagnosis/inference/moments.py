"""Moments of events elsewhere: the likelihood over them has several optima within seconds of the right one."""

from __future__ import annotations

import numpy as np

from estimator.diagnosis.inference.disturbances import Whitener
from estimator.physics.fit import FitResult
from estimator.physics.jacobian import changes
from estimator.physics.moments import MOVES, OFFSETS_S, movable, shifted
from estimator.physics.problem import own_part, simulated_each
from estimator.signals.record import FloatArray

WORTH_MOVING = 2.0
"""Fall of the squared innovations that moments elsewhere must bring."""


def moved(result: FitResult, filtered: Whitener) -> FloatArray | None:
    """Return the unknowns with moments where the innovations are less; None where they are nowhere."""
    x, better = result.x.copy(), False
    for i in range(len(result.problem.records)):
        local = _moved_in(result, filtered, i)
        if local is not None:
            x[own_part(result.problem, i)], better = local, True
    return x if better else None


def _moved_in(result: FitResult, filtered: Whitener, index: int) -> FloatArray | None:
    basis, local = result.problem.local[index], result.local_of(index).copy()
    ends = movable(basis)
    if not ends:
        return None
    taken_up = _initial_state(result, filtered, index)
    began = best = float(_squares(result, filtered, index, taken_up, [local])[0])
    first, last = (float(each) for each in result.problem.records[index].since_start_s[[0, -1]])
    for begin, end in ends:
        may_move = [row for row in (begin, end) if basis.low[row] < basis.high[row]]
        sets = [[row] for row in may_move] + ([may_move] if len(may_move) > 1 else [])
        for _ in range(MOVES):
            tried = [shifted(local, rows, offset) for rows in sets for offset in OFFSETS_S]
            tried += [shifted(local, [row], {begin: first, end: last}[row] - local[row]) for row in may_move]
            tried = [each for each in tried if first <= each[begin] <= each[end] <= max(last, local[end])]
            tried = [each for each in tried if np.all(each >= basis.low) and np.all(each <= basis.high)]
            if not tried:
                break
            squares = _squares(result, filtered, index, taken_up, tried)
            if squares.min() >= best:
                break
            best, local = float(squares.min()), tried[int(squares.argmin())]
    return local if best < began - WORTH_MOVING else None


def _initial_state(result: FitResult, filtered: Whitener, index: int) -> FloatArray:
    """Return an orthonormal basis of what load torque and initial state do to the innovations."""
    first = own_part(result.problem, index).start
    columns = np.arange(first, first + result.problem.local[index].own_rows.start)
    return np.linalg.qr(filtered.part(index, changes(result.problem, result.x, index, columns, result.outputs)))[0]


def _squares(
    result: FitResult, filtered: Whitener, index: int, taken_up: FloatArray, tried: list[FloatArray]
) -> FloatArray:
    """Return the squared innovations for each of several vectors that differ in moments, shape (K,)."""
    record, use = result.problem.records[index], result.problem.use[index]
    outputs = simulated_each(result.problem, [(result.p, x) for x in tried], index)
    errors = filtered.part(index, (outputs - record.output)[:, use].T).T
    left: FloatArray = (errors**2).sum(axis=1) - ((errors @ taken_up) ** 2).sum(axis=1)
    return left
