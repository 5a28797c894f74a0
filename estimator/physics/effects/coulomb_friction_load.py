"""Dry friction on the load side: a constant torque against the motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.physics.effect import WITH_SHAFT, Effect, EffectParameter, Element, Start, Untestable
from estimator.physics.effects import coulomb_friction_motor
from estimator.physics.model import DrivelineModel, Motion, unit
from estimator.physics.motion import torque_scale
from estimator.signals.record import Record


def scales(model: DrivelineModel, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use."""
    return (0.05 * torque_scale(records),)


def starts(model: DrivelineModel, records: Sequence[Record]) -> list[Start]:
    """Return one start: the problem is convex in the friction torque."""
    return [(0.5,)]


def testable(model: DrivelineModel, records: Sequence[Record]) -> Untestable | None:
    """Need a recording in which the speed takes both signs."""
    return coulomb_friction_motor.testable(model, records)


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return f"dry friction of {values['friction_nm']:.3g} {unit('torque', motion)} on the load side"


EFFECT = Effect(
    name="coulomb_friction_load",
    element=Element.LOAD,
    title="dry friction at the load",
    law="T_f = T_c sign(w_L)",
    source="Armstrong-Hélouvry, Dupont, Canudas de Wit: Automatica 30(7), 1994",
    excited_by="speed that changes sign: reversal",
    parameters=(EffectParameter("friction_nm", "torque", 0.0, 0.0, 40.0, "friction torque T_c"),),
    structures=WITH_SHAFT,
    resembles=("coulomb_friction_motor", "stribeck_friction", "brake_drag"),
    equivalent=(),
    contains=(),
    scales=scales,
    starts=starts,
    testable=testable,
    sentence=sentence,
)
