"""The last metres to an event's moments: the error has several optima within tenths of a second of the right one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import ITERATIONS, FitResult, Problem, fit, output_of
from estimator.signals.record import FloatArray

OFFSETS_S = np.array([0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.5])
OFFSETS_S = np.concatenate([-OFFSETS_S[::-1], OFFSETS_S])
"""Where else the error is looked at, around the moment a fit ended at."""

ROUNDS = 3

WORTH = 20.0
"""Gain in log-likelihood ratio, twice, that an event in one recording must bring: it was sought among hundreds."""


def polished(result: FitResult, iterations: int = ITERATIONS) -> FitResult:
    """Move the moments of events to where the error is smallest nearby, and fit on from there while it helps."""
    for _ in range(ROUNDS):
        x = _moved(result)
        if x is None:
            return result
        better = fit(result.problem, x, iterations)
        if better.squares >= result.squares:
            return result
        result = better
    return result


def without_idle(result: FitResult, iterations: int = ITERATIONS) -> FitResult:
    """Take an event out of each recording that does as well without it.

    An event that lasts all along is the constant load torque in another guise; one of no weight fits the noise.
    """
    n = result.residual.size
    for index in range(len(result.problem.records)):
        silent = _silenced(result, index)
        if silent is None:
            continue
        problem, x = silent
        without = fit(problem, x, iterations)
        if n * math.log(without.squares / result.squares) < WORTH:
            result = without
    return result


def _silenced(result: FitResult, index: int) -> tuple[Problem, FloatArray] | None:
    """Return the problem with one recording's events held empty, and the unknowns for it; None where it has none."""
    basis = result.problem.local[index]
    if not any(EFFECTS[u.effect].event and u.low < u.high for u in basis.own):
        return None
    began = {u.effect: u.low for u in basis.own if u.name == "from_s"}
    held = tuple(
        replace(u, low=began[u.effect], high=began[u.effect], start=began[u.effect]) if EFFECTS[u.effect].event else u
        for u in basis.own
    )
    local = tuple(replace(b, own=held) if i == index else b for i, b in enumerate(result.problem.local))
    x = result.x.copy()
    first = len(result.problem.shared) + sum(b.guess.size for b in result.problem.local[:index])
    for row, unknown in zip(range(first + basis.own_rows.start, first + basis.own_rows.stop), held, strict=True):
        if EFFECTS[unknown.effect].event:
            x[row] = unknown.start
    return replace(result.problem, local=local), x


def _moved(result: FitResult) -> FloatArray | None:
    """Return the unknowns with moments moved, one after the other; None where none is better elsewhere."""
    x, moved = result.x.copy(), False
    first = len(result.problem.shared)
    for i, basis in enumerate(result.problem.local):
        rows = basis.own_rows
        for row, unknown in zip(range(first + rows.start, first + rows.stop), basis.own, strict=True):
            if EFFECTS[unknown.effect].event and unknown.low < unknown.high:
                tried = np.unique(np.clip(x[row] + OFFSETS_S, unknown.low, unknown.high))
                squares = [_squares(result, x, i, row, value) for value in (x[row], *tried)]
                best = int(np.argmin(squares))
                if best > 0:
                    x[row], moved = tried[best - 1], True
        first += basis.guess.size
    return x if moved else None


def _squares(result: FitResult, x: FloatArray, index: int, row: int, value: float) -> float:
    tried = x.copy()
    tried[row] = value
    record, use = result.problem.records[index], result.problem.use[index]
    error = (output_of(result.problem, tried, index) - record.output)[use]
    return float(error @ error)
