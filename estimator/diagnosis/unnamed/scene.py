"""A fit as the search for laws sees it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from estimator.diagnosis.line import PLACES, Explanation, Line, Motion, Place, explain_all, lines
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.model import Structure
from estimator.signals.record import OutputKind


@dataclass(frozen=True, slots=True)
class Scene:
    """A fit in blocks, with the input that explains its error at every place."""

    result: FitResult
    cut: tuple[Line, ...]
    explanations: Mapping[Place, Explanation]

    def motions(self, element: Element) -> list[Motion]:
        """Return what happens in each recording: when its output is read, or between, where torques act."""
        at_reading = PLACES[element] is Place.SENSOR
        return [line.reading if at_reading else line.motion for line in self.cut]


def scene(result: FitResult, floor: float) -> Scene:
    """Look at the error of a fit from every place."""
    cut = lines(result)
    return Scene(result, cut, explain_all(result, cut, floor))


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
