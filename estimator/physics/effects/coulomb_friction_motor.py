"""Dry friction on the motor side: a constant torque against the motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Start, Untestable
from estimator.physics.model import DrivelineModel, Motion, unit
from estimator.physics.motion import reverses, torque_scale
from estimator.signals.record import Record


def scales(model: DrivelineModel, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use: friction worth modelling is of that order."""
    return (0.05 * torque_scale(records),)


def starts(model: DrivelineModel, records: Sequence[Record]) -> list[Start]:
    """Return one start: the problem is convex in the friction torque."""
    return [(0.5,)]


def testable(model: DrivelineModel, records: Sequence[Record]) -> Untestable | None:
    """Need a recording in which the speed takes both signs."""
    if any(reverses(record) for record in records):
        return None
    return Untestable("the speed never changes sign: not separable from the constant load torque", "reversal")


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    torque = unit("torque", motion)
    return f"dry friction of {values['friction_nm']:.3g} {torque} acts at the motor against the motion"


EFFECT = Effect(
    name="coulomb_friction_motor",
    element=Element.MOTOR,
    title="dry friction at the motor",
    law="T_f = T_c sign(w_M)",
    source="Armstrong-Hélouvry, Dupont, Canudas de Wit: Automatica 30(7), 1994",
    excited_by="motion in both directions, through standstill",
    parameters=(EffectParameter("friction_nm", "torque", 0.0, 0.0, 40.0, "friction torque T_c"),),
    structures=EVERY_LINE,
    resembles=("stribeck_friction", "quadratic_friction", "backlash", "shaft_hysteresis", "coulomb_friction_load"),
    equivalent=(),
    contains=(),
    scales=scales,
    starts=starts,
    testable=testable,
    sentence=sentence,
)
