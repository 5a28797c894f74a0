"""Dry friction on the load side: a constant torque against the motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import WITH_SHAFT, Effect, EffectParameter, Element, Held, Retelling, Start, Untestable
from estimator.physics.effects import coulomb_friction_motor
from estimator.physics.effects.coulomb_friction_motor import CREEP, forms_near_rest
from estimator.signals.record import Record

STICKING = 0.02
"""Presliding of a contact that sticks, in the scale of one that deflects."""

PRESLIDING = EffectParameter(
    "presliding_rad",
    "angle",
    0.0,
    0.5 * STICKING,
    10.0,
    "deflection at which it breaks away: x_b",
    True,
    form="presliding",
)


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return those of a motor: both have bearings and seals."""
    return coulomb_friction_motor.scales(model, records)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return one start: the problem is convex in the friction torque; presliding and creep wait for it."""
    return [(0.5, Held(0.0), Held(0.0))]


def retold(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[Retelling]:
    """Return the friction that was found, bending before it slides, or sticking: less than a heavy load shows."""
    return bending("friction_nm", model, records, values)


def bending(size: str, model: Driveline, records: Sequence[Record], values: Mapping[str, float]) -> list[Retelling]:
    """Return the same of dry friction at the load whose torque is the parameter ``size``."""
    return forms_near_rest(size, scales(model, records), values, (1.0, STICKING))


def testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need a recording in which the speed takes both signs."""
    return coulomb_friction_motor.testable(model, records)


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return f"dry friction of {values['friction_nm']:.3g} {unit('torque', motion)} on the load side"


EFFECT = Effect(
    name="coulomb_friction_load",
    element=Element.LOAD,
    title="dry friction at the load",
    law="T_f = T_c sign(w_L); with presliding dT_f/dt = (T_c / x_b) (w_L - |w_L| T_f / T_c); creeping "
    "T_f = T_c tanh(w_L / w_c)",
    source="Armstrong-Hélouvry, Dupont, Canudas de Wit: Automatica 30(7), 1994; presliding: Dahl, AIAA J. 14(12), 1976",
    excited_by="speed that changes sign: reversal",
    parameters=(EffectParameter("friction_nm", "torque", 0.0, 0.0, 40.0, "friction torque T_c"), PRESLIDING, CREEP),
    structures=WITH_SHAFT,
    resembles=("coulomb_friction_motor", "stribeck_friction", "brake_drag"),
    scales=scales,
    starts=starts,
    testable=testable,
    retold=retold,
    sentence=sentence,
    linear=True,
)
