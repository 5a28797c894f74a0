"""What a recording has of its own of an effect, found by a scan: phases of an angle, moments of an event.

Neither is convex: a fit that starts half a period or a few seconds off ends in the wrong place. Around the state
without the effect the output answers to a small one in proportion, so that phases follow from the answers to a cosine
and a sine, and moments from the answers to the effect in every cell of a grid over time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

from estimator.least_squares import least_inside, unbounded_first
from estimator.physics.effect import Effect
from estimator.physics.fit import FitResult
from estimator.physics.layout import slot
from estimator.physics.problem import bounds
from estimator.physics.unknowns import Shared
from estimator.signals.record import FloatArray, Record

MOST_CELLS = 40
SHORTEST_CELL_S = 0.5
"""Grid of the moments of an event: half a second, or a fortieth of a longer recording; a fit moves them from there."""

SMALL = 0.1  # answers are taken at this share of an effect's size, where they are in proportion to it


class Projector:
    """Takes out of stacked signals what the unknowns of a fit could explain, to first order."""

    def __init__(self, result: FitResult) -> None:
        low, high = bounds(result.problem)
        jacobian = result.jacobian
        movable = unbounded_first(low, high, (low < high) & jacobian.any(axis=0))
        self._free = np.linalg.qr(jacobian[:, ~result.pinned])[0]
        self._all, self._triangle = np.linalg.qr(jacobian[:, movable])
        x = result.x[movable]
        self._room = low[movable] - x, high[movable] - x
        self._residual, self._rows = result.residual, result.problem.rows
        self.error = self.rest(result.residual)

    def rest(self, signals: FloatArray) -> FloatArray:
        """Return signals (K, R) without what the unknowns that are free can imitate."""
        return signals - (signals @ self._free) @ self._free.T

    def products(self, answers: FloatArray, index: int) -> tuple[FloatArray, FloatArray]:
        """Return the products of what is left of answers with each other, (K, K), and with ``error``, (K,)."""
        rows = self._rows[index]
        seen = answers @ self._free[rows]
        return answers @ answers.T - seen @ seen.T, answers @ self.error[rows]

    def promise(self, direction: FloatArray, low: float, high: float) -> tuple[float, float]:
        """Return how far to go along a direction, within bounds, and by how much the squared error falls.

        The unknowns move along within their own bounds, so that one that was pressed against a bound can come back.
        """
        along, across = self._all.T @ direction, 0.0
        rest = direction - self._all @ along
        across = float(np.linalg.norm(rest))
        if across == 0.0:
            return 0.0, 0.0
        target = -np.append(self._all.T @ self._residual, float(rest @ self._residual) / across)
        corner = np.append(np.zeros(along.size), across)
        triangle = np.vstack([np.column_stack([self._triangle, along]), corner])
        lowest, highest = np.append(self._room[0], low), np.append(self._room[1], high)
        moved = least_inside(triangle, target, np.minimum(lowest, 0.0), np.maximum(highest, 0.0))
        left = triangle @ moved - target
        return float(moved[-1]), float(target @ target - left @ left)


class Simulate(Protocol):
    """K parameter vectors to the simulated samples that count, shape (K, R)."""

    def __call__(self, parameters: Sequence[FloatArray], alike_s: FloatArray | None = None) -> FloatArray:
        """Return the simulated samples."""


def cell_s(record: Record) -> float:
    """Return how far apart the moments are that are tried in a recording [s]."""
    length_s = float(record.since_start_s[-1])
    return length_s / min(MOST_CELLS, max(4, round(length_s / SHORTEST_CELL_S)))


@dataclass(frozen=True, slots=True)
class Wave:
    """Answers to one amplitude of a periodic effect at phase 0 and a quarter turn on, per unit of it; shape (2, R)."""

    phase: str  # name of the parameter that is the phase
    amplitude: str  # name of its amplitude
    answers: FloatArray  # at phase 0 and a quarter turn later, per unit of the amplitude


@dataclass(frozen=True, slots=True)
class Cells:
    """Answers to an event of unit size from the first moment of a grid to each of its moments."""

    moments_s: FloatArray  # (M,): time since the recording began [s]
    answers: FloatArray  # (M, R): the first row is 0: no event


def waves(entry: Effect, p: FloatArray, sizes: Mapping[str, float], run: Simulate, still: FloatArray) -> list[Wave]:
    """Return the answers of one recording to each amplitude of a periodic effect; ``still`` is its output without."""
    moved = small_waves(entry, p, sizes)
    return answers_to(entry, sizes, run(moved), still) if moved else []


def small_waves(entry: Effect, p: FloatArray, sizes: Mapping[str, float]) -> list[FloatArray]:
    """Return parameters with a small one of each amplitude alone, at phase 0 and a quarter turn on, one by one."""
    silent = p.copy()
    for amplitude in entry.phases.values():
        silent[slot(entry.name, amplitude)] = 0.0
    moved = []
    for phase, amplitude in _acting(entry, sizes):
        for angle in (0.0, 0.5 * math.pi):
            moved.append(silent.copy())
            moved[-1][slot(entry.name, amplitude)] = SMALL * sizes[amplitude]
            moved[-1][slot(entry.name, phase)] = angle
    return moved


def answers_to(entry: Effect, sizes: Mapping[str, float], outputs: FloatArray, still: FloatArray) -> list[Wave]:
    """Return the answers of the outputs to each amplitude of a periodic effect that is not 0."""
    return [
        Wave(phase, amplitude, (outputs[2 * i : 2 * i + 2] - still) / (SMALL * sizes[amplitude]))
        for i, (phase, amplitude) in enumerate(_acting(entry, sizes))
    ]


def _acting(entry: Effect, sizes: Mapping[str, float]) -> list[tuple[str, str]]:
    return [(phase, amplitude) for phase, amplitude in entry.phases.items() if sizes[amplitude] != 0.0]


def cells(entry: Effect, p: FloatArray, own: tuple[Shared, ...], sizes: Mapping[str, float], run: Simulate) -> Cells:
    """Return the answers of one recording to an event in every cell of a grid over its time, summed from the first."""
    begin, end = (next(u for u in own if (u.effect, u.name) == (entry.name, name)) for name in ("from_s", "to_s"))
    count = min(MOST_CELLS, max(4, round((begin.high - begin.low) / SHORTEST_CELL_S)))
    moments = np.linspace(begin.low, begin.high, count + 1)
    silent = p.copy()
    silent[begin.slot] = silent[end.slot] = begin.low
    size_name, size = next(iter(sizes.items()))
    moved = [silent]
    for low, high in pairwise(moments):
        moved.append(silent.copy())
        moved[-1][slot(entry.name, size_name)] = SMALL * size
        moved[-1][begin.slot], moved[-1][end.slot] = low, high
    outputs = run(moved, moments[[0, *range(count)]])
    return Cells(moments, np.cumsum((outputs - outputs[0]) / (SMALL * size), axis=0))


@dataclass(frozen=True, slots=True)
class Stretch:
    """The best interval for an event in one recording: rows of the grid, and what an event takes away there."""

    first: int  # row of the grid
    last: int  # row of the grid
    error_reduction: float  # squared error that an event there takes away
    match: float  # product of its answer and the error
    power: float  # squared answer


@dataclass(frozen=True, slots=True)
class Scan:
    """What a grid of answers and an error have to say to each other, for every interval of the grid at once."""

    along: FloatArray  # (M, M): product of the error with the answer from row a to row b
    power: FloatArray  # (M, M): squared norm of that answer

    def best(self, size: float) -> Stretch:
        """Return the interval in which an event of a size takes most away."""
        with np.errstate(over="ignore"):  # so large an event only adds to the error: -inf
            taken = np.triu(-size * (2.0 * self.along + size * self.power), 1)
        first, last = np.unravel_index(int(taken.argmax()), taken.shape)
        if taken[first, last] <= 0.0:
            return Stretch(0, 0, 0.0, 0.0, 0.0)
        along, power = float(self.along[first, last]), float(self.power[first, last])
        return Stretch(int(first), int(last), float(taken[first, last]), along, power)


def scan(answers: FloatArray, error: FloatArray, lasting: bool = False) -> Scan:
    """Prepare the search of all intervals of a grid."""
    return scanned(answers @ answers.T, answers @ error, lasting)


def scanned(gram: FloatArray, match: FloatArray, lasting: bool = False) -> Scan:
    """Prepare the same search from the products of the answers with each other, (M, M), and with the error, (M,)."""
    along = match[None, :] - match[:, None]
    power = np.maximum(np.diag(gram)[:, None] - 2.0 * gram + np.diag(gram)[None, :], 0.0)
    if lasting:
        along[1:, :-1] = power[1:, :-1] = 0.0
    return Scan(along, power)
