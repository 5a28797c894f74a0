"""Dry friction on the motor side: a constant torque against the motion."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Held, Retelling, Start, Untestable
from estimator.physics.model import DrivelineModel, Motion, unit
from estimator.physics.motion import torque_scale, turns
from estimator.signals.record import Record

HELD_HZ = 20.0
"""Where a machine that is held by its dry friction may swing: a motor of 1 kg m^2 whose seals and bearings bend by a
milliradian before 16 Nm tear them loose. A fit begins there and moves on."""


def scales(model: DrivelineModel, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use, and the presliding with which a motor held by it swings at 20 Hz."""
    friction = 0.05 * torque_scale(records)
    return (friction, friction / (model.parameters["J_M"].value * (2.0 * math.pi * HELD_HZ) ** 2))


def starts(model: DrivelineModel, records: Sequence[Record]) -> list[Start]:
    """Return one start: the problem is convex in the friction torque, without presliding, which waits for it."""
    return [(0.5, Held(0.0))]


def retold(
    model: DrivelineModel, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[Retelling]:
    """Return the friction that was found, bending before it slides."""
    if values["presliding_rad"] > 0.0:
        return []
    friction, _ = scales(model, records)
    return [Retelling((values["friction_nm"] / friction, 1.0), {})]


def testable(model: DrivelineModel, records: Sequence[Record]) -> Untestable | None:
    """Need a speed that takes both signs, in one recording or in several that share their load; or a known load."""
    if turns(model, records):
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
    law="T_f = T_c sign(w_M); with presliding dT_f/dt = (T_c / x_b) (w_M - |w_M| T_f / T_c)",
    source="Armstrong-Hélouvry, Dupont, Canudas de Wit: Automatica 30(7), 1994; presliding: Dahl, AIAA J. 14(12), 1976",
    excited_by="motion in both directions, through standstill",
    parameters=(
        EffectParameter("friction_nm", "torque", 0.0, 0.0, 40.0, "friction torque T_c"),
        EffectParameter("presliding_rad", "angle", 0.0, 0.05, 10.0, "deflection at which it breaks away: x_b", True),
    ),
    structures=EVERY_LINE,
    resembles=("stribeck_friction", "quadratic_friction", "backlash", "shaft_hysteresis", "coulomb_friction_load"),
    scales=scales,
    starts=starts,
    testable=testable,
    retold=retold,
    sentence=sentence,
    linear=True,
)
