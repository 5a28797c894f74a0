"""Drag of the air on the vehicle: it grows with the square of its speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Start, Untestable
from estimator.physics.effects import quadratic_friction
from estimator.physics.model import DrivelineModel, Motion, unit
from estimator.physics.motion import speed_scale, torque_scale
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
    return quadratic_friction.testable(model, records)


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    drag = unit("quadratic_drag", motion)
    return f"drag on the load that grows with the square of its speed: {values['drag_nm_s2']:.3g} {drag}"


EFFECT = Effect(
    name="aerodynamic_drag",
    element=Element.LOAD,
    title="aerodynamic drag",
    law="T_d = q w_L |w_L|",
    source="Gillespie, Fundamentals of Vehicle Dynamics, SAE 1992",
    excited_by="a wide range of speeds, high ones among them",
    parameters=(EffectParameter("drag_nm_s2", "quadratic_drag", 0.0, 0.0, 40.0, "torque per speed squared: q"),),
    structures=EVERY_LINE,
    resembles=("quadratic_friction", "road_grade"),
    equivalent=(),
    contains=(),
    scales=scales,
    starts=starts,
    testable=testable,
    sentence=sentence,
)
