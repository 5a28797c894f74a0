"""The places of the line at which something may act that the model lacks, and which law acts where."""

from __future__ import annotations

from enum import Enum

from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.model import Structure
from estimator.physics.motion import speed_scale, torque_scale


class Place(Enum):
    """Where an unknown input may act: on the motor, in the shaft, against the load, on the reading."""

    MOTOR = "motor"
    SHAFT = "shaft"
    LOAD = "load"
    SENSOR = "sensor"


FORCES = {Place.MOTOR: (1.0, 0.0), Place.SHAFT: (-1.0, -1.0), Place.LOAD: (0.0, 1.0), Place.SENSOR: (0.0, 0.0)}
"""Torque on the motor and torque against the load per unit of the input."""

PLACES = {
    Element.TORQUE_PATH: Place.MOTOR,
    Element.MOTOR: Place.MOTOR,
    Element.SHAFT: Place.SHAFT,
    Element.LOAD: Place.LOAD,
    Element.SPEED_SENSOR: Place.SENSOR,
    Element.ACQUISITION: Place.SENSOR,
}
"""Where a law of an element acts."""

DRIVES = {Element.TORQUE_PATH: 1.0, Element.MOTOR: -1.0, Element.SHAFT: 1.0, Element.LOAD: 1.0}
"""Sign of a law at its place: the torque path drives the motor, friction at the motor brakes it."""


def places(result: FitResult) -> tuple[Place, ...]:
    """Return the places that a fit's structure has."""
    if result.problem.grid.structure is Structure.JOINT:
        return (Place.SHAFT,)
    if result.problem.grid.structure is Structure.ONE_MASS:
        return (Place.MOTOR, Place.SENSOR)
    return tuple(Place)


def size_at(result: FitResult, place: Place) -> float:
    """Return the size in use of what acts at a place: torque, or speed at the sensor."""
    records = result.problem.records
    return speed_scale(records) if place is Place.SENSOR else torque_scale(records)
