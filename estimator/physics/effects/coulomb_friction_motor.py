"""Dry friction on the motor side: a constant torque against the motion."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Held, Retelling, Start, Untestable
from estimator.physics.motion import speed_scale, torque_scale, turns
from estimator.signals.record import Record

HELD_HZ = 20.0
"""Where a machine that is held by its dry friction may swing: a motor of 1 kg m^2 whose seals and bearings bend by a
milliradian before 16 Nm tear them loose. A fit begins there and moves on."""


CREEPS_OVER = 0.01
"""Share of the top speed over which a creeping friction changes sign, by scale: that of a line without a form of it."""

PRESLIDING = EffectParameter(
    "presliding_rad", "angle", 0.0, 0.05, 10.0, "deflection at which it breaks away: x_b", True, form="presliding"
)
CREEP = EffectParameter(
    "creep_rad_s", "speed", 0.0, 0.02, 20.0, "speed over which it creeps near rest: w_c", True, form="creeping"
)


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use, presliding by which a motor swings at 20 Hz, and a usual creep."""
    friction = 0.05 * torque_scale(records)
    presliding = friction / (model.parameters["J_M"].value * (2.0 * math.pi * HELD_HZ) ** 2)
    return (friction, presliding, CREEPS_OVER * speed_scale(records))


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return one start: the problem is convex in the friction torque; presliding and creep wait for it."""
    return [(0.5, Held(0.0), Held(0.0))]


def retold(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[Retelling]:
    """Return the friction that was found, bending before it slides, or creeping near rest."""
    return forms_near_rest("friction_nm", scales(model, records), values, (1.0,))


def forms_near_rest(
    size: str, scale: Sequence[float], values: Mapping[str, float], presliding: Sequence[float]
) -> list[Retelling]:
    """Return a dry friction that was found sharp in its forms near rest, bent by each ``presliding``, or creeping.

    The sizes before the two shapes keep what was found.
    """
    if values["presliding_rad"] > 0.0 or values["creep_rad_s"] > 0.0:
        return []
    found = values[size] / scale[0]
    return [Retelling((found, bent, Held(0.0)), {}) for bent in presliding] + [Retelling((found, Held(0.0), 1.0), {})]


def testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
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
    law="T_f = T_c sign(w_M); with presliding dT_f/dt = (T_c / x_b) (w_M - |w_M| T_f / T_c); creeping "
    "T_f = T_c tanh(w_M / w_c)",
    source="Armstrong-Hélouvry, Dupont, Canudas de Wit: Automatica 30(7), 1994; presliding: Dahl, AIAA J. 14(12), 1976",
    excited_by="motion in both directions, through standstill",
    parameters=(
        EffectParameter("friction_nm", "torque", 0.0, 0.0, 40.0, "friction torque T_c"),
        PRESLIDING,
        CREEP,
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
