"""The signals that a law may be drawn over, element by element, and their units."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from estimator.diagnosis.line import Motion, Place
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.layout import slot
from estimator.physics.model import Motion as Kind
from estimator.physics.model import unit
from estimator.signals.record import FloatArray


@dataclass(frozen=True, slots=True)
class Axis:
    """A signal that a law may be drawn over: its name, the dimension of its unit, and its values."""

    name: str
    dimension: str
    values: Callable[[Motion, FitResult], FloatArray]


def _twist_torque(motion: Motion, result: FitResult) -> FloatArray:
    torque: FloatArray = result.p[slot("", "k")] * motion.twist
    return torque


TORQUE = Axis("torque", "torque", lambda m, _: m.torque)
MOTOR_SPEED = Axis("motor speed", "speed", lambda m, _: m.speed)
LOAD_SPEED = Axis("load speed", "speed", lambda m, _: m.load_speed)
TWIST_TORQUE = Axis("shaft torque k·twist", "torque", _twist_torque)
TWIST_RATE = Axis("twist rate", "speed", lambda m, _: m.speed - m.load_speed)
ACCELERATION = Axis("acceleration", "speed/s", lambda m, _: np.gradient(m.speed, m.time_s))
ANGLE = Axis("motor angle in its turn", "rad", lambda m, _: np.mod(m.angle, 2.0 * np.pi))
TIME = Axis("time", "s", lambda m, _: m.time_s)

AXES: Mapping[Element, tuple[Axis, ...]] = {
    Element.TORQUE_PATH: (TORQUE, MOTOR_SPEED, ANGLE, TIME),
    Element.MOTOR: (MOTOR_SPEED, ACCELERATION, TORQUE, ANGLE, TIME),
    Element.SHAFT: (TWIST_TORQUE, TWIST_RATE, MOTOR_SPEED, ANGLE, TIME),
    Element.LOAD: (LOAD_SPEED, TWIST_TORQUE, TIME),
    Element.SPEED_SENSOR: (MOTOR_SPEED, ACCELERATION, ANGLE, TORQUE, TIME),
    Element.ACQUISITION: (ACCELERATION, TIME),
}


def signal_unit(dimension: str, kind: Kind) -> str:
    """Return the unit of a signal of a dimension."""
    return f"{unit('speed', kind)}/s" if dimension == "speed/s" else unit(dimension, kind)


def input_unit(place: Place, result: FitResult, kind: Kind) -> str:
    """Return the unit of an input at a place."""
    if place is not Place.SENSOR:
        return unit("torque", kind)
    names = {"speed": "speed", "position": "angle", "force": "torque"}
    return unit(names[result.problem.records[0].kind.value], kind)
