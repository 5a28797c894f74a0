"""Drag at the motor that grows with the square of its speed: fan, oil churning."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.physics.acting import Acting, Place
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Start, Untestable
from estimator.physics.model import DrivelineModel, Motion, unit
from estimator.physics.motion import speed_scale, speeds_differ, torque_scale
from estimator.signals.record import Record


@compiled
def law(speed: float, drag: float) -> float:
    """Return the drag ``q w |w|`` against the motion [Nm]."""
    return drag * speed * abs(speed)


def scales(model: DrivelineModel, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use at the top speed."""
    return (0.05 * torque_scale(records) / speed_scale(records) ** 2,)


def starts(model: DrivelineModel, records: Sequence[Record]) -> list[Start]:
    """Return one start: the problem is convex in the drag."""
    return [(0.5,)]


def testable(model: DrivelineModel, records: Sequence[Record]) -> Untestable | None:
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
    law="T_f = q w_M |w_M|",
    source="fan and windage loss: Pyrhönen, Jokinen, Hrabovcová, Design of Rotating Electrical Machines, 2014",
    excited_by="a wide range of speeds",
    parameters=(EffectParameter("quadratic_nm_s2", "quadratic_drag", 0.0, 0.0, 40.0, "torque per speed squared: q"),),
    acting=Acting(Place.MOTOR, law),
    structures=EVERY_LINE,
    resembles=("coulomb_friction_motor", "aerodynamic_drag"),
    scales=scales,
    starts=starts,
    testable=testable,
    sentence=sentence,
)
