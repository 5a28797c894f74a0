"""Eddy-current drag at the motor: it rises with the speed, levels off, and falls beyond a peak."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from estimator.compiled import compiled
from estimator.lanes import choose, every
from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import EVERY_LINE, Acting, Effect, EffectParameter, Element, Place, Start, Untestable
from estimator.physics.motion import measured_speed, speed_scale, torque_scale
from estimator.signals.record import FloatArray, Record

LEAST_RANGE = 0.2
"""Share of its top speed that the speed of a recording must range over: in less any law of it is a straight line."""

STRAIGHT = 3.0
"""Peak speed over the top speed from which on the law is a straight line, as viscous friction is: 10 % off it."""


@compiled
def law(speed: float, peak: float, peak_speed: float) -> float:
    """Return ``2 T_p s / (1 + s^2)`` with ``s = w/w_p``, the torque against the motion."""
    if every(peak == 0.0):
        return 0.0
    ratio = speed / choose(peak_speed > 0.0, peak_speed, 1.0)
    return choose(peak_speed > 0.0, 2.0 * peak * ratio / (1.0 + ratio * ratio), 0.0)


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use and the top speed."""
    return (0.05 * torque_scale(records), speed_scale(records))


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return a peak inside the speeds driven and one at their end: the error is not convex in the peak's speed."""
    return [(1.0, 0.15), (1.0, 0.6)]


def speed_of(record: Record) -> FloatArray:
    """Return the speeds that were measured."""
    speed = measured_speed(record)
    return speed[np.isfinite(speed)]


def testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need speeds far enough apart."""
    if any(float(np.ptp(speed_of(record))) >= LEAST_RANGE * speed_scale([record]) for record in records):
        return None
    return Untestable("the speed hardly varies: not separable from viscous friction and the constant load", "reversal")


def implausible(model: Driveline, records: Sequence[Record], values: Mapping[str, float]) -> str:
    """Object to a drag that does not level off in the speeds driven."""
    top = speed_scale(records)
    if values["peak_rad_s"] < STRAIGHT * top:
        return ""
    return f"a drag that is greatest at {values['peak_rad_s']:.3g} {unit('speed', model.motion)} is viscous friction"


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return (
        f"a drag at the motor rises with its speed to {values['peak_nm']:.3g} {unit('torque', motion)} "
        f"at {values['peak_rad_s']:.3g} {unit('speed', motion)} and falls beyond, as eddy currents brake"
    )


EFFECT = Effect(
    name="eddy_drag",
    element=Element.MOTOR,
    title="drag that levels off",
    law="T_f = 2 T_p s / (1 + s^2), s = w_M / w_p",
    source="Wouterse: Critical torque and speed of eddy current brake, IEE Proceedings B 138(4), 1991",
    excited_by="motion at very different speeds, low ones among them",
    parameters=(
        EffectParameter("peak_nm", "torque", 0.0, 0.0, 40.0, "greatest drag: T_p"),
        EffectParameter("peak_rad_s", "speed", 1.0, 0.02, 5.0, "speed of the greatest drag: w_p"),
    ),
    example={"peak_nm": 40.0, "peak_rad_s": 2.0},
    acting=Acting(Place.MOTOR, law),
    structures=EVERY_LINE,
    resembles=("coulomb_friction_motor", "stribeck_friction", "quadratic_friction"),
    scales=scales,
    starts=starts,
    testable=testable,
    implausible=implausible,
    sentence=sentence,
)
