"""The way to an event's moments: the error has several optima within seconds of the right one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import ITERATIONS, FitResult, fit
from estimator.physics.jacobian import changes
from estimator.physics.parallel import concurrently
from estimator.physics.problem import Problem, own_part, simulated_each
from estimator.physics.steps import EDGE_S, inside, moments_of
from estimator.physics.unknowns import LocalBasis
from estimator.signals.record import FloatArray, Record

OFFSETS_S = np.array([0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.6, 1.2, 2.4])
OFFSETS_S = np.concatenate([-OFFSETS_S[::-1], OFFSETS_S])
"""Where else the error is looked at, around the moment a fit ended at; and at the recording's own end, however far."""

REACH_S = 0.5
"""How far a fit may go on from a moment that was moved: beyond it others match."""

WORTH_MOVING = 2.0
"""Gain in log-likelihood ratio, twice, that moments elsewhere must bring: they are sought among hundreds."""

MOVES = 4
"""Moves of one event in one recording before the next fit."""

WORTH = 20.0
"""Gain in log-likelihood ratio, twice, that an event in one recording must bring: it was sought among hundreds."""


def without_idle(result: FitResult, iterations: int = ITERATIONS) -> FitResult:
    """Take an event out of each recording that does as well without it.

    An event that lasts all along is the constant load torque in another guise; one of no weight fits the noise; one of
    less than half a second at a recording's end fits what the start of a simulation leaves.
    """
    n = result.residual.size
    for index in range(len(result.problem.records)):
        silent = _silenced(result, index)
        if silent is None:
            continue
        problem, x = silent
        without = fit(problem, x, iterations)
        if _is_at_an_end(result, index) or n * math.log(without.squares / result.squares) < WORTH:
            result = without
    return result


def _is_at_an_end(result: FitResult, index: int) -> bool:
    """Tell whether all that events do in a recording, they do so near to an end of it that it could be none."""
    record = result.problem.records[index]
    return all(
        to_s - from_s < EDGE_S and not (inside(record, from_s) and inside(record, to_s))
        for from_s, to_s in _acting(result, index)
    )


def _acting(result: FitResult, index: int) -> list[tuple[float, float]]:
    """Return from when to when each event acts in a recording [s since its start]."""
    names = {u.effect for u in result.problem.local[index].own}
    return [moments_of(result, name)[index] for name in names if EFFECTS[name].event]


def _silenced(result: FitResult, index: int) -> tuple[Problem, FloatArray] | None:
    """Return the problem with one recording's events held empty, and the unknowns for it; None where they are."""
    basis = result.problem.local[index]
    if all(to_s == from_s for from_s, to_s in _acting(result, index)):
        return None
    began = {u.effect: u.low for u in basis.own if u.name == "from_s"}
    held = tuple(
        replace(u, low=began[u.effect], high=began[u.effect], start=began[u.effect]) if EFFECTS[u.effect].event else u
        for u in basis.own
    )
    local = tuple(replace(b, own=held) if i == index else b for i, b in enumerate(result.problem.local))
    x = result.x.copy()
    first = own_part(result.problem, index).start
    for row, unknown in zip(range(first + basis.own_rows.start, first + basis.own_rows.stop), held, strict=True):
        if EFFECTS[unknown.effect].event:
            x[row] = unknown.start
    return replace(result.problem, local=local), x


def moved(result: FitResult) -> tuple[Problem, FloatArray] | None:
    """Return the problem around moments that were moved, and its unknowns; None where none is better elsewhere."""
    found = concurrently(lambda i: _moved_in(result, i), range(len(result.problem.records)))
    if all(local is None for local in found):
        return None
    bases, parts = [], [result.x[: len(result.problem.shared)]]
    for i, (basis, local) in enumerate(zip(result.problem.local, found, strict=True)):
        parts.append(result.local_of(i) if local is None else local)
        bases.append(basis if local is None else _around(basis, local, result.problem.records[i]))
    return replace(result.problem, local=tuple(bases)), np.concatenate(parts)


def _moved_in(result: FitResult, index: int) -> FloatArray | None:
    """Return one recording's unknowns with moments moved; None where none is better elsewhere."""
    basis, local = result.problem.local[index], result.local_of(index).copy()
    ends = movable(basis)
    if not ends:
        return None
    misfit = _Misfit(result, index)
    began = best = float(misfit.squares([local])[0])
    least = WORTH_MOVING * result.squares / result.residual.size
    first, last = (float(each) for each in result.problem.records[index].since_start_s[[0, -1]])
    for begin, end in ends:
        may_move = [row for row in (begin, end) if basis.low[row] < basis.high[row]]
        own_end = {begin: first, end: last}
        moves = [[row] for row in may_move] + ([may_move] if len(may_move) > 1 else [])
        for _ in range(MOVES):
            tried = [shifted(local, rows, offset) for rows in moves for offset in OFFSETS_S]
            tried += [shifted(local, [row], own_end[row] - local[row]) for row in may_move]
            tried = [local, *(x for x in tried if first <= x[begin] < x[end] <= max(last, local[end]))]
            squares = misfit.squares(tried)
            if squares.min() >= best:
                break
            best = float(squares.min())
            local = tried[int(squares.argmin())]
    return local if best < began - least else None


def shifted(local: FloatArray, rows: list[int], offset_s: float) -> FloatArray:
    """Return one recording's unknowns with some moments moved."""
    x = local.copy()
    x[rows] += offset_s
    return x


def movable(basis: LocalBasis) -> list[tuple[int, int]]:
    """Return where beginning and end of each event that may move stand among a recording's unknowns."""
    place = {(u.effect, u.name): row for row, u in enumerate(basis.own, start=basis.own_rows.start)}
    free = {u.effect for u in basis.own if EFFECTS[u.effect].event and u.low < u.high}
    return [(place[effect, "from_s"], place[effect, "to_s"]) for effect in sorted(free)]


def _around(basis: LocalBasis, local: FloatArray, record: Record) -> LocalBasis:
    """Return a basis whose moments may be fitted around where they are."""
    first, last = (float(end) for end in record.since_start_s[[0, -1]])
    own = tuple(
        replace(u, start=at, low=max(first, at - REACH_S), high=min(last, at + REACH_S))
        if EFFECTS[u.effect].event and u.low < u.high
        else u
        for u, at in zip(basis.own, (float(value) for value in local[basis.own_rows]), strict=True)
    )
    return replace(basis, own=own)


def _alike_s(tried: Sequence[FloatArray]) -> FloatArray:
    """Return up to when each of several vectors that differ in moments is as the first, shape (K,) [s]."""
    earliest = np.minimum(tried, tried[0])
    alike: FloatArray = np.where(tried == tried[0], np.inf, earliest).min(axis=1)
    return alike


class _Misfit:
    """The error of one recording for other moments, less what its load torque and initial state could take up."""

    def __init__(self, result: FitResult, index: int) -> None:
        self._problem, self._p, self._index = result.problem, result.p, index
        first = own_part(result.problem, index).start
        columns = np.arange(first, first + result.problem.local[index].own_rows.start)
        self._taken_up = np.linalg.qr(changes(result.problem, result.x, index, columns, result.outputs))[0]

    def squares(self, tried: Sequence[FloatArray]) -> FloatArray:
        """Return the squared error for each of several vectors that differ in moments, shape (K,)."""
        record, use = self._problem.records[self._index], self._problem.use[self._index]
        outputs = simulated_each(self._problem, [(self._p, x) for x in tried], self._index, _alike_s(tried))
        errors = (outputs - record.output)[:, use]
        left: FloatArray = (errors**2).sum(axis=1) - ((errors @ self._taken_up) ** 2).sum(axis=1)
        return left
