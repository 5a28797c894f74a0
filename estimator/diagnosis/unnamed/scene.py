"""A fit as the search for laws sees it, what of its error re-tuning could explain, and a law in its simulation.

What re-tuning could explain is taken out before laws are held against the error.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from estimator.diagnosis.line.blocks import (
    DRIVES,
    FORCES,
    NO_FORCE,
    PLACES,
    BlockedRecording,
    Force,
    InputPlace,
    Motion,
    block_mean_of,
    lines,
    simulated_each,
)
from estimator.diagnosis.line.equivalent import Explanation, explain_all
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.jacobian import jacobian_at
from estimator.physics.model import Structure
from estimator.signals.record import BoolArray, FloatArray, OutputKind


class Filter(Protocol):
    """Whitens the errors of a fit, and whatever else moves its output."""

    def part(self, index: int, columns: FloatArray) -> FloatArray:
        """Return the innovations of one recording's samples in use, shapes (R_i, K)."""


@dataclass(frozen=True, slots=True)
class Scene:
    """A fit in blocks, with the input that explains its error at every place.

    With a ``filter`` the blocks are single samples, and laws are weighed by the innovations that they explain.
    """

    result: FitResult
    cut: tuple[BlockedRecording, ...]
    explanations: Mapping[InputPlace, Explanation]
    filter: Filter | None = None

    def motions(self, element: Element) -> list[Motion]:
        """Return what happens in each recording: when its output is read, or between, where torques act."""
        at_reading = PLACES[element] is InputPlace.SENSOR
        return [line.reading if at_reading else line.motion for line in self.cut]

    def rows(self, index: int, columns: FloatArray) -> FloatArray:
        """Return signals of one recording, shape (B, K) over its blocks, on the rows that laws are fitted to."""
        line = self.cut[index]
        if self.filter is None:
            return columns[line.rows]
        return self.filter.part(index, columns[line.okay])[line.stretches[line.okay]]

    @property
    def errors(self) -> list[FloatArray]:
        """Measured less simulated output on these rows, per recording."""
        return [self.rows(i, line.error[:, np.newaxis])[:, 0] for i, line in enumerate(self.cut)]

    @property
    def as_read(self) -> list[FloatArray]:
        """The same without the filter."""
        return replace(self, filter=None).errors


def scene(result: FitResult, floor: float, whitening: Filter | None = None) -> Scene:
    """Look at the error of a fit from every place."""
    cut = lines(result, length=None if whitening is None else 1)
    return Scene(result, cut, explain_all(result, cut, floor), whitening)


def elements(result: FitResult) -> tuple[Element, ...]:
    if result.problem.grid.structure is Structure.JOINT:
        return (Element.SHAFT,)
    found = [Element.TORQUE_PATH, Element.MOTOR]
    if result.problem.grid.structure is not Structure.ONE_MASS:
        found += [Element.SHAFT, Element.LOAD]
    if result.problem.records[0].kind is OutputKind.SPEED:
        found += [Element.SPEED_SENSOR, Element.ACQUISITION]
    return tuple(found)


class Ground:
    """What the free unknowns of a fit could explain, to first order; rows are the blocks in use of all recordings."""

    def __init__(
        self, cut: Sequence[BlockedRecording], jacobian: FloatArray, error: FloatArray, pinned: BoolArray
    ) -> None:
        self.jacobian, self.raw, self.unknowns = jacobian, error, jacobian.shape[1]
        self.basis = np.linalg.qr(jacobian[:, ~pinned])[0]
        self._sizes = np.cumsum([int(line.rows.sum()) for line in cut])[:-1]
        self.error = self.rest(error)

    def rest(self, signals: FloatArray) -> FloatArray:
        return signals - self.basis @ (self.basis.T @ signals)

    def split(self, rows: FloatArray) -> list[FloatArray]:
        return list(np.split(rows, self._sizes))


def ground_of(view: Scene) -> Ground:
    """Return what re-tuning a fit further could explain of its error."""
    result = view.result
    jacobian = jacobian_at(result.problem, result.x, result.outputs)
    row, parts = 0, []
    for i, (line, use) in enumerate(zip(view.cut, result.problem.use, strict=True)):
        count, full = int(use.sum()), np.zeros(use.size)
        part = np.empty((line.size, result.x.size))
        for j in range(result.x.size):
            full[use] = jacobian[row : row + count, j]
            part[:, j] = block_mean_of(full, use, line.length)[0]
        row += count
        parts.append(view.rows(i, part))
    return Ground(view.cut, np.vstack(parts), np.concatenate(view.errors), result.pinned)


@dataclass(frozen=True, slots=True)
class Extra:
    """A law's torques and error of the reading over the samples of each recording."""

    forces: list[Force]
    readings: list[FloatArray]

    def outputs(self, result: FitResult, points: Sequence[FloatArray], index: int) -> FloatArray:
        """Simulate the output of one recording with the law at K vectors of unknowns, shape (K, N)."""
        return simulated_each(result, points, index, self.forces[index]) + self.readings[index]


def extra_of(view: Scene, element: Element, weights: Sequence[FloatArray]) -> Extra:
    """Return a law at an element, given per recording as a function of time of shape (B,), over the samples."""
    samples = [line.samples(w) for line, w in zip(view.cut, weights, strict=True)]
    if PLACES[element] is InputPlace.SENSOR:
        return Extra([NO_FORCE] * len(samples), samples)
    motor, load = (DRIVES[element] * force for force in FORCES[PLACES[element]])
    return Extra([(motor * w, load * w) for w in samples], [np.zeros_like(w) for w in samples])
