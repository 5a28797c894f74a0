"""A fit as the search for laws sees it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from estimator.diagnosis.line import PLACES, Explanation, Line, Motion, Place, explain_all, lines
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.model import Structure
from estimator.signals.record import FloatArray, OutputKind


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
    cut: tuple[Line, ...]
    explanations: Mapping[Place, Explanation]
    filter: Filter | None = None

    def motions(self, element: Element) -> list[Motion]:
        """Return what happens in each recording: when its output is read, or between, where torques act."""
        at_reading = PLACES[element] is Place.SENSOR
        return [line.reading if at_reading else line.motion for line in self.cut]

    def rows(self, index: int, columns: FloatArray) -> FloatArray:
        """Return signals of one recording, shape (B, K) over its blocks, on the rows that laws are fitted to."""
        line = self.cut[index]
        if self.filter is None:
            return columns[line.rows]
        whitened: FloatArray = self.filter.part(index, columns[line.okay])[line.stretches[line.okay]]
        return whitened

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
    """Return the elements at which laws are tried on a fit."""
    if result.problem.grid.structure is Structure.JOINT:
        return (Element.SHAFT,)
    found = [Element.TORQUE_PATH, Element.MOTOR]
    if result.problem.grid.structure is not Structure.ONE_MASS:
        found += [Element.SHAFT, Element.LOAD]
    if result.problem.records[0].kind is OutputKind.SPEED:
        found += [Element.SPEED_SENSOR, Element.ACQUISITION]
    return tuple(found)
