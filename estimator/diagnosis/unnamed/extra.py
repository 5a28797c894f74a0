"""A law in the simulation, as torques and an error of the reading over the samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.diagnosis.line import DRIVES, FORCES, NO_FORCE, PLACES, Force, Place, simulated_each
from estimator.diagnosis.unnamed.scene import Scene
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.signals.record import FloatArray


@dataclass(frozen=True, slots=True)
class Extra:
    """A law's torques and error of the reading over the samples of each recording."""

    forces: list[Force]
    readings: list[FloatArray]

    def outputs(self, result: FitResult, points: Sequence[FloatArray], index: int) -> FloatArray:
        """Simulate the output of one recording with the law at K vectors of unknowns, shape (K, N)."""
        moved: FloatArray = simulated_each(result, points, index, self.forces[index]) + self.readings[index]
        return moved


def extra_of(view: Scene, element: Element, weights: Sequence[FloatArray]) -> Extra:
    """Return a law at an element, given per recording as a function of time of shape (B,), over the samples."""
    samples = [line.samples(w) for line, w in zip(view.cut, weights, strict=True)]
    if PLACES[element] is Place.SENSOR:
        return Extra([NO_FORCE] * len(samples), samples)
    motor, load = (DRIVES[element] * force for force in FORCES[PLACES[element]])
    return Extra([(motor * w, load * w) for w in samples], [np.zeros_like(w) for w in samples])
