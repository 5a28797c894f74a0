"""Dry friction at the motor and at the load, with a Stribeck effect, and of a brake; its forms near rest."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.lanes import every
from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import (
    EVERY_LINE,
    MOMENTS,
    WITH_SHAFT,
    Acting,
    Effect,
    EffectParameter,
    Element,
    Held,
    OtherForm,
    Place,
    Untestable,
)
from estimator.physics.laws import LEAST, fading, share_inside
from estimator.physics.motion import reverses, speed_scale, torque_scale, turns
from estimator.signals.record import Record

# Dry friction on the motor side: a constant torque against the motion.


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

STICKING = 0.02  # presliding of a contact that sticks, in the scale of one that deflects

LOAD_PRESLIDING = EffectParameter(
    "presliding_rad",
    "angle",
    0.0,
    0.5 * STICKING,
    10.0,
    "deflection at which it breaks away: x_b",
    True,
    form="presliding",
)


@compiled
def coulomb_law(speed: float, friction: float, presliding: float, creep: float) -> float:
    """Return ``T_c``, the friction torque while it slides [Nm]."""
    return friction


def motor_scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use [Nm], the twist [rad] at which bristles hold it, a speed of creep."""
    friction = 0.05 * torque_scale(records)
    presliding = friction / (model.parameters["J_M"].value * (2.0 * math.pi * HELD_HZ) ** 2)
    return (friction, presliding, CREEPS_OVER * speed_scale(records))


def motor_reparametrised(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[OtherForm]:
    """Return the friction that was found, bending before it slides, or creeping near rest."""
    return forms_near_rest("friction_nm", motor_scales(model, records), values, (1.0,))


def forms_near_rest(
    size: str, scale: Sequence[float], values: Mapping[str, float], presliding: Sequence[float]
) -> list[OtherForm]:
    """Return a dry friction that was found sharp in its forms near rest, bent by each ``presliding``, or creeping."""
    if values["presliding_rad"] > 0.0 or values["creep_rad_s"] > 0.0:
        return []
    found = values[size] / scale[0]
    return [OtherForm((found, bent, Held(0.0)), {}) for bent in presliding] + [OtherForm((found, Held(0.0), 1.0), {})]


def motor_testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need a speed that changes its sign: else it is a constant load torque."""
    if turns(model, records):
        return None
    return Untestable("the speed never changes sign: not separable from the constant load torque", "reversal")


COULOMB_FRICTION_MOTOR = Effect(
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
    acting=Acting(Place.MOTOR_DRY, coulomb_law),
    structures=EVERY_LINE,
    resembles=("stribeck_friction", "quadratic_friction", "backlash", "shaft_hysteresis", "coulomb_friction_load"),
    scales=motor_scales,
    starts=lambda _model, _records: [(0.5, Held(0.0), Held(0.0))],
    testable=motor_testable,
    reparametrised=motor_reparametrised,
    text="dry friction of {friction_nm:.3g} {unit[torque]} acts at the motor against the motion",
    linear=True,
)


# Dry friction on the load side: a constant torque against the motion.


@compiled
def load_coulomb_law(time_s: float, length_s: float, friction: float, presliding: float, creep: float) -> float:
    """Return ``T_c``, the friction torque while it slides [Nm]."""
    return friction


def load_scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return those of a motor: both have bearings and seals."""
    return motor_scales(model, records)


def load_reparametrised(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[OtherForm]:
    """Return the friction that was found, bending before it slides, or sticking: less than a heavy load shows."""
    return bending("friction_nm", model, records, values)


def bending(size: str, model: Driveline, records: Sequence[Record], values: Mapping[str, float]) -> list[OtherForm]:
    """Return the same of dry friction at the load whose torque is the parameter ``size``."""
    return forms_near_rest(size, load_scales(model, records), values, (1.0, STICKING))


def load_testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need a speed that changes its sign, as at the motor."""
    return motor_testable(model, records)


COULOMB_FRICTION_LOAD = Effect(
    name="coulomb_friction_load",
    element=Element.LOAD,
    title="dry friction at the load",
    law="T_f = T_c sign(w_L); with presliding dT_f/dt = (T_c / x_b) (w_L - |w_L| T_f / T_c); creeping "
    "T_f = T_c tanh(w_L / w_c)",
    source="Armstrong-Hélouvry, Dupont, Canudas de Wit: Automatica 30(7), 1994; presliding: Dahl, AIAA J. 14(12), 1976",
    excited_by="speed that changes sign: reversal",
    parameters=(
        EffectParameter("friction_nm", "torque", 0.0, 0.0, 40.0, "friction torque T_c"),
        LOAD_PRESLIDING,
        CREEP,
    ),
    acting=Acting(Place.LOAD_DRY, load_coulomb_law),
    structures=WITH_SHAFT,
    resembles=("coulomb_friction_motor", "stribeck_friction", "brake_drag"),
    scales=load_scales,
    starts=lambda _model, _records: [(0.5, Held(0.0), Held(0.0))],
    testable=load_testable,
    reparametrised=load_reparametrised,
    text="dry friction of {friction_nm:.3g} {unit[torque]} on the load side",
    linear=True,
)


# Dry friction that is higher near standstill: breakaway torque falling to the Coulomb level with speed.


@compiled
def stribeck_law(
    speed: float, excess: float, coulomb: float, stribeck_speed: float, presliding: float, creep: float
) -> float:
    """Return ``T_c + T_x exp(-(w/w_s)^2)``, the friction torque while it slides [Nm]."""
    if every(excess == 0.0):
        return coulomb
    ratio = speed / max(stribeck_speed, LEAST)
    return coulomb + excess * fading(ratio * ratio)


def stribeck_scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use, twice, a twentieth of the top speed, a usual presliding, and creep."""
    torque, presliding, creep = motor_scales(model, records)
    return (torque, torque, 0.05 * speed_scale(records), presliding, creep)


def stribeck_reparametrised(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[OtherForm]:
    """Return the friction that was found, bending before it slides, or creeping near rest."""
    if values["presliding_rad"] > 0.0 or values["creep_rad_s"] > 0.0:
        return []
    found = (values[name] for name in ("excess_nm", "coulomb_nm", "stribeck_rad_s"))
    start = tuple(value / scale for value, scale in zip(found, stribeck_scales(model, records)[:3], strict=True))
    return [OtherForm((*start, 1.0, Held(0.0)), {}), OtherForm((*start, Held(0.0), 1.0), {})]


def stribeck_testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need a speed that changes its sign, as dry friction does."""
    return motor_testable(model, records)


def stribeck_sentence(values: Mapping[str, float], motion: Motion) -> str:
    """State the torque at breakaway, what it falls to, and over which speed."""
    torque, speed = unit("torque", motion), unit("speed", motion)
    breakaway = values["coulomb_nm"] + values["excess_nm"]
    return (
        f"dry friction at the motor with a Stribeck effect: {breakaway:.3g} {torque} at breakaway, falling to "
        f"{values['coulomb_nm']:.3g} {torque} above about {values['stribeck_rad_s']:.3g} {speed}"
    )


STRIBECK_FRICTION = Effect(
    name="stribeck_friction",
    element=Element.MOTOR,
    title="Stribeck friction at the motor",
    law="T_f = g(w_M) sign(w_M), g = T_c + T_x exp(-(w_M/w_s)^2); with presliding "
    "dT_f/dt = ((T_c + T_x) / x_b) (w_M - |w_M| T_f / g); creeping T_f = g(w_M) tanh(w_M / w_c)",
    source="Armstrong-Hélouvry, Dupont, Canudas de Wit: Automatica 30(7), 1994; presliding: Canudas de Wit and others, "
    "IEEE Trans. Automat. Contr. 40(3), 1995",
    excited_by="slow motion in both directions, several passes through standstill",
    parameters=(
        EffectParameter("excess_nm", "torque", 0.0, 0.0, 40.0, "breakaway torque above T_c: T_x"),
        EffectParameter("coulomb_nm", "torque", 0.0, 0.0, 40.0, "friction torque at speed: T_c"),
        EffectParameter("stribeck_rad_s", "speed", 0.0, 0.02, 20.0, "speed range of the fall: w_s"),
        PRESLIDING,
        CREEP,
    ),
    acting=Acting(Place.MOTOR_DRY, stribeck_law),
    either=("excess_nm", "coulomb_nm"),
    structures=EVERY_LINE,
    resembles=("coulomb_friction_motor", "backlash", "coulomb_friction_load"),
    contains=("coulomb_friction_motor",),
    scales=stribeck_scales,
    starts=lambda _model, _records: [(0.5, 0.3, width, Held(0.0), Held(0.0)) for width in (0.6, 1.5, 3.0)],
    testable=stribeck_testable,
    reparametrised=stribeck_reparametrised,
    text=stribeck_sentence,
    linear=True,
)


# A brake that drags for a while.


@compiled
def brake_law(
    time_s: float, length_s: float, brake: float, presliding: float, creep: float, from_s: float, to_s: float
) -> float:
    """Return the braking torque, from one moment to the next [Nm]."""
    return share_inside(time_s, length_s, from_s, to_s) * brake


def brake_reparametrised(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[OtherForm]:
    """Return the brake that was found, bending before it slides, sticking or creeping, where a recording shows that."""
    if not any(reverses(record) for record in records):
        return []
    return bending("brake_nm", model, records, values)


BRAKE_DRAG = Effect(
    name="brake_drag",
    element=Element.LOAD,
    title="dragging brake",
    law="T_b = T_B sign(w_L) from t_1 to t_2 of a recording; with presliding "
    "dT_b/dt = (T_B / x_b) (w_L - |w_L| T_b / T_B); creeping T_b = T_B tanh(w_L / w_c)",
    source="residual drag of friction brakes: Breuer, Bill, Brake Technology Handbook, SAE 2008; presliding: Dahl, "
    "AIAA J. 14(12), 1976",
    excited_by="driving, with stretches with and without",
    parameters=(
        EffectParameter("brake_nm", "torque", 0.0, 0.0, 60.0, "braking torque T_B"),
        LOAD_PRESLIDING,
        CREEP,
        *MOMENTS,
    ),
    acting=Acting(Place.LOAD_DRY, brake_law),
    structures=EVERY_LINE,
    resembles=("generator_coupled", "coulomb_friction_load", "road_grade"),
    event=True,
    permanent="coulomb_friction_load",
    scales=lambda model, records: load_scales(model, records),
    starts=lambda _model, _records: [(0.5, Held(0.0), Held(0.0))],
    reparametrised=brake_reparametrised,
    text="a brake drags with {brake_nm:.3g} {unit[torque]} during a part of the recording",
    linear=True,
)
