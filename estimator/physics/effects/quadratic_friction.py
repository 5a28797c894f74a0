"""Drag at the motor that grows with the square of its speed: fan, oil churning."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.lanes import choose, every
from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import (
    EVERY_LINE,
    Acting,
    Effect,
    EffectParameter,
    Element,
    Held,
    Place,
    Retelling,
    Start,
    Untestable,
)
from estimator.physics.laws import power
from estimator.physics.motion import speed_scale, speeds_differ, torque_scale
from estimator.signals.record import Record

SQUARE = 2.0

EXPONENT = EffectParameter(
    "exponent", "", SQUARE, 1.7, 2.1, "power of the speed: n", True, most=2.1, form="another power"
)
AT = EffectParameter("at_rad_s", "speed", 1.0, 0.01, math.inf, "speed at which q is so much: w_1", True)


@compiled
def law(speed: float, drag: float, exponent: float, at: float) -> float:
    """Return the drag ``q w |w| |w/w_1|^(n-2)`` against the motion [Nm]."""
    square = drag * speed * abs(speed)
    if every(exponent == SQUARE):
        return square
    return square * choose(exponent == SQUARE, 1.0, power(abs(speed) / at, exponent - SQUARE))


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use at the top speed, 1, and the top speed."""
    top = speed_scale(records)
    return (0.05 * torque_scale(records) / top**2, 1.0, top)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return one start: the problem is convex in the drag. Its exponent waits for it."""
    return [(0.5, Held(SQUARE), Held(1.0))]


def retold(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[Retelling]:
    """Return the drag that was found with an exponent that is not 2."""
    return other_power("quadratic_nm_s2", scales(model, records)[0], values)


def other_power(size: str, scale: float, values: Mapping[str, float]) -> list[Retelling]:
    """Return the same of a drag whose size is the parameter ``size``."""
    if values["exponent"] != SQUARE:
        return []
    return [Retelling((values[size] / scale, SQUARE - 0.05, Held(1.0)), {})]


def testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need speeds that differ, or else it is the constant load."""
    if speeds_differ(records):
        return None
    return Untestable("the speed is the same all along: not separable from the constant load torque", "reversal")


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    drag = unit("quadratic_drag", motion)
    return f"drag at the motor that grows with the square of its speed: {values['quadratic_nm_s2']:.3g} {drag}"


EFFECT = Effect(
    name="quadratic_friction",
    element=Element.MOTOR,
    title="quadratic friction at the motor",
    law="T_f = q w_M |w_M| |w_M/w_1|^(n-2), n = 2",
    source="fan and windage loss: Pyrhönen, Jokinen, Hrabovcová, Design of Rotating Electrical Machines, 2014",
    excited_by="a wide range of speeds",
    parameters=(
        EffectParameter("quadratic_nm_s2", "quadratic_drag", 0.0, 0.0, 40.0, "torque per speed squared: q"),
        EXPONENT,
        AT,
    ),
    acting=Acting(Place.MOTOR, law),
    structures=EVERY_LINE,
    resembles=("coulomb_friction_motor", "aerodynamic_drag"),
    scales=scales,
    starts=starts,
    testable=testable,
    retold=retold,
    sentence=sentence,
)
