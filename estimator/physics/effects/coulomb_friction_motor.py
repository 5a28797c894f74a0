"""Dry friction on the motor side: a constant torque against the motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.physics.effect import Effect, EffectParameter, Element, Start, Untestable
from estimator.physics.laws import smooth_sign
from estimator.physics.model import DrivelineModel, Motion, Structure, unit
from estimator.physics.motion import reverses, torque_scale
from estimator.signals.record import Record


@compiled
def law(speed: float, friction: float, width: float) -> float:
    """Return the friction torque ``T_c sign(w)`` against the motion."""
    return friction * smooth_sign(speed, width)


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
    source="Armstrong-Helouvry, Dupont, Canudas de Wit: Automatica 30(7), 1994, section 3",
    excited_by="motion in both directions, through standstill",
    parameters=(EffectParameter("friction_nm", "torque", 0.0, 0.0, 40.0, "friction torque T_c"),),
    structures=frozenset({Structure.ONE_MASS, Structure.TWO_MASS}),
    resembles=("stribeck_friction", "coulomb_friction_load", "backlash"),
    equivalent=(),
    contains=(),
    scales=scales,
    starts=starts,
    testable=testable,
    sentence=sentence,
)
