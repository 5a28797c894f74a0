"""Drag over the speed, friction by direction, of cold oil and in the gears."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from estimator.compiled import compiled
from estimator.lanes import choose, every
from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import (
    EVERY_LINE,
    WITH_SHAFT,
    Acting,
    Effect,
    EffectParameter,
    Element,
    FitStart,
    Held,
    OtherForm,
    Place,
    Span,
    Untestable,
)
from estimator.physics.laws import power
from estimator.physics.motion import (
    longest_s,
    measured_speed,
    reverses,
    speed_by_place,
    speed_scale,
    speeds_differ,
    torque_reverses,
    torque_scale,
    turns,
)
from estimator.signals.record import FloatArray, Record

# Drag at the motor that grows with the square of its speed: fan, oil churning.


SQUARE = 2.0

EXPONENT = EffectParameter(
    "exponent", "", SQUARE, 1.7, 2.1, "power of the speed: n", True, most=2.1, form="another power"
)
AT = EffectParameter("at_rad_s", "speed", 1.0, 0.01, math.inf, "speed at which q is so much: w_1", True)

LEAST_RANGE = 0.2
"""Share of its top speed that the speed of a recording must range over: in less any law of it is a straight line."""

STRAIGHT = 3.0
"""Peak speed over the top speed from which on the law is a straight line, as viscous friction is: 10 % off it."""

BY_PLACE = 0.5
"""Share of the speed's variance that may go with the place: beyond it most of the law would be a torque over it."""


@compiled
def quadratic_law(speed: float, drag: float, exponent: float, at: float) -> float:
    """Return the drag ``q w |w| |w/w_1|^(n-2)`` against the motion [Nm]."""
    square = drag * speed * abs(speed)
    if every(exponent == SQUARE):
        return square
    return square * choose(exponent == SQUARE, 1.0, power(abs(speed) / at, exponent - SQUARE))


def quadratic_scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a drag of a twentieth of the torque in use at top speed [Nm s²/rad²], 1, and the top speed."""
    top = speed_scale(records)
    return (0.05 * torque_scale(records) / top**2, 1.0, top)


def quadratic_starts(model: Driveline, records: Sequence[Record]) -> list[FitStart]:
    """Return one start: the problem is convex in the drag. Its exponent waits for it."""
    return [(0.5, Held(SQUARE), Held(1.0))]


def quadratic_reparametrised(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[OtherForm]:
    """Return the drag that was found with an exponent that is not 2."""
    return other_power("quadratic_nm_s2", quadratic_scales(model, records)[0], values)


def other_power(size: str, scale: float, values: Mapping[str, float]) -> list[OtherForm]:
    """Return the same of a drag whose size is the parameter ``size``."""
    if values["exponent"] != SQUARE:
        return []
    return [OtherForm((values[size] / scale, SQUARE - 0.05, Held(1.0)), {})]


def quadratic_testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need speeds that differ, or else it is the constant load."""
    if speeds_differ(records):
        return None
    return Untestable("the speed is the same all along: not separable from the constant load torque", "reversal")


QUADRATIC_FRICTION = Effect(
    name="quadratic_friction",
    element=Element.MOTOR,
    title="quadratic friction at the motor",
    law="T_f = q w_M |w_M| |w_M/w_1|^(n-2), n = 2",
    source="fan and windage loss: Pyrhönen, Jokinen, Hrabovcová, Design of Rotating Electrical Machines, 2014",
    excited_by="a wide range of speeds",
    parameters=(
        EffectParameter("quadratic_nm_s2", "quadratic_drag", 0.0, 0.0, 40.0, "torque per speed squared: q"),
        EXPONENT,
        AT,
    ),
    acting=Acting(Place.MOTOR, quadratic_law),
    structures=EVERY_LINE,
    resembles=("coulomb_friction_motor", "aerodynamic_drag"),
    scales=quadratic_scales,
    starts=quadratic_starts,
    testable=quadratic_testable,
    reparametrised=quadratic_reparametrised,
    text="drag at the motor that grows with the square of its speed: {quadratic_nm_s2:.3g} {unit[quadratic_drag]}",
)


# Drag of the air on the vehicle: it grows with the square of its speed.


def air_reparametrised(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[OtherForm]:
    """Return the drag that was found with an exponent that is not 2."""
    return other_power("drag_nm_s2", quadratic_scales(model, records)[0], values)


AERODYNAMIC_DRAG = Effect(
    name="aerodynamic_drag",
    element=Element.LOAD,
    title="aerodynamic drag",
    law="T_d = q w_L |w_L| |w_L/w_1|^(n-2), n = 2",
    source="Gillespie, Fundamentals of Vehicle Dynamics, SAE 1992",
    excited_by="a wide range of speeds, high ones among them",
    parameters=(
        EffectParameter("drag_nm_s2", "quadratic_drag", 0.0, 0.0, 40.0, "torque per speed squared: q"),
        EXPONENT,
        AT,
    ),
    acting=Acting(Place.LOAD, quadratic_law),
    structures=EVERY_LINE,
    resembles=("quadratic_friction", "road_grade"),
    scales=quadratic_scales,
    starts=quadratic_starts,
    testable=quadratic_testable,
    reparametrised=air_reparametrised,
    text="drag on the load that grows with the square of its speed: {drag_nm_s2:.3g} {unit[quadratic_drag]}",
)


# Eddy-current drag at the motor: it rises with the speed, levels off, and falls beyond a peak.


@compiled
def eddy_law(speed: float, peak: float, peak_speed: float) -> float:
    """Return ``2 T_p s / (1 + s^2)`` with ``s = w/w_p``, the torque against the motion."""
    if every(peak == 0.0):
        return 0.0
    ratio = speed / choose(peak_speed > 0.0, peak_speed, 1.0)
    return choose(peak_speed > 0.0, 2.0 * peak * ratio / (1.0 + ratio * ratio), 0.0)


def speed_of(record: Record) -> FloatArray:
    """Return the measured speed [rad/s] where there is one."""
    speed = measured_speed(record)
    return speed[np.isfinite(speed)]


def eddy_testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need a speed that varies: at one speed it is viscous friction and a constant load."""
    if any(float(np.ptp(speed_of(record))) >= LEAST_RANGE * speed_scale([record]) for record in records):
        return None
    return Untestable("the speed hardly varies: not separable from viscous friction and the constant load", "reversal")


def eddy_implausible(model: Driveline, records: Sequence[Record], values: Mapping[str, float]) -> str:
    """Object to a peak beyond the speeds in use: below it the drag is viscous friction."""
    top = speed_scale(records)
    if values["peak_rad_s"] < STRAIGHT * top:
        return ""
    return f"a drag that is greatest at {values['peak_rad_s']:.3g} {unit('speed', model.motion)} is viscous friction"


EDDY_DRAG = Effect(
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
    acting=Acting(Place.MOTOR, eddy_law),
    structures=EVERY_LINE,
    resembles=("coulomb_friction_motor", "stribeck_friction", "quadratic_friction"),
    scales=lambda _model, records: (0.05 * torque_scale(records), speed_scale(records)),
    starts=lambda _model, _records: [(1.0, 0.15), (1.0, 0.6)],
    testable=eddy_testable,
    implausible=eddy_implausible,
    text="a drag at the motor rises with its speed to {peak_nm:.3g} {unit[torque]} at {peak_rad_s:.3g} "
    "{unit[speed]} and falls beyond, as eddy currents brake",
)


# Viscous friction at the motor that is not the same forward and backward: seals, helical gears, worn bearings.


@compiled
def by_direction_law(speed: float, difference: float) -> float:
    """Return ``d |w|``: what is more forward is less backward [Nm]."""
    return difference * abs(speed)


def by_direction_testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need both directions, and places that are passed at more than one speed."""
    both = [record for record in records if reverses(record)]
    if not both:
        return Untestable("the speed never changes sign: not separable from viscous friction", "reversal")
    if min(speed_by_place(record) for record in both) > BY_PLACE:
        return Untestable("each place is passed at one speed: not separable from a torque over the angle", "reversal")
    return None


def by_direction_sentence(values: Mapping[str, float], motion: Motion) -> str:
    """State the difference of viscous friction by direction."""
    size = f"{abs(values['difference_nm_s']):.3g} {unit('damping', motion)}"
    more, less = ("forward", "backward") if values["difference_nm_s"] > 0.0 else ("backward", "forward")
    return f"friction at the motor depends on the direction: {size} more {more} and as much less {less}"


ASYMMETRIC_FRICTION = Effect(
    name="asymmetric_friction",
    element=Element.MOTOR,
    title="friction by direction",
    law="T_f = d |w_M|: b_M + d forward, b_M - d backward; dry friction that differs is a constant load torque",
    source="friction by direction: Kelly, Davila Santibáñez, Loría, Control of Robot Manipulators, Springer 2005",
    excited_by="motion in both directions at different speeds",
    parameters=(EffectParameter("difference_nm_s", "damping", 0.0, -40.0, 40.0, "half the difference: d"),),
    example={"difference_nm_s": 3.0},
    acting=Acting(Place.MOTOR, by_direction_law),
    structures=EVERY_LINE,
    resembles=("coulomb_friction_motor", "road_grade", "torque_nonlinearity"),
    scales=lambda _model, records: (0.05 * torque_scale(records) / speed_scale(records),),
    starts=lambda _model, _records: [(0.5,), (-0.5,)],
    testable=by_direction_testable,
    text=by_direction_sentence,
)


# Viscous friction that decays as the oil warms.


@compiled
def warming_law(
    damping: float, time_s: float, length_s: float, cold: float, time_constant_s: float, warm: float
) -> float:
    """Return the viscous friction with what has not gone away yet [Nm s/rad]."""
    if every(cold == 0.0):
        return damping
    return damping + cold * (1.0 - warm) * math.exp(-time_s / time_constant_s)


def warming_described(
    model: Driveline, values: Mapping[str, float], line: Mapping[str, float]
) -> Mapping[str, tuple[Span, ...]]:
    """Return the friction it warms: from cold to warm."""
    name = "b_L" if "b_L" in line else "b_M"
    return {name: ((line[name], line[name] + values["cold_nm_s"]),)}


WARMING_FRICTION = Effect(
    name="warming_friction",
    element=Element.LOAD,
    title="friction of warming oil",
    law="b_L becomes b_L + b_cold (1 - h_0) exp(-t / tau)",
    source="viscosity of oil over temperature (Walther's equation): ASTM D341",
    excited_by="steady driving from cold",
    parameters=(
        EffectParameter("cold_nm_s", "damping", 0.0, 0.0, 60.0, "friction that goes away: b_cold"),
        EffectParameter("time_constant_s", "s", 1.0, 0.02, 10.0, "time constant of warming: tau"),
        EffectParameter(
            "warm", "", 0.0, 0.0, 1.0, "share gone as a recording begins: h_0", True, True, most=1, outlasts=True
        ),
    ),
    acting=Acting(Place.LOAD_DAMPING, warming_law),
    structures=EVERY_LINE,
    resembles=("torque_derating", "road_grade"),
    scales=lambda _model, records: (0.05 * torque_scale(records) / speed_scale(records), longest_s(records)),
    starts=lambda _model, _records: [(1.0, 0.3), (2.0, 1.5)],
    text="viscous friction falls by {cold_nm_s:.3g} {unit[damping]} as the oil warms, with a time constant "
    "of {time_constant_s:.3g} s",
    described=warming_described,
    waving=True,
    timed=True,
)


# Torque is lost in the gears in proportion to what they transmit, and not the same in both directions of power.


@compiled
def gears_law(torque: float, sign: float, driving: float, back: float) -> float:
    """Return the torque that is lost [Nm], against the motion, whose sign is rounded at standstill."""
    if every(driving == 0.0) and every(back == 0.0):
        return 0.0
    return sign * abs(torque) * choose(torque * sign > 0.0, driving, back)


def gears_testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need both signs of torque and of speed, or else it is a gain of the torque or a constant load."""
    if turns(model, records) and any(torque_reverses(record) for record in records):
        return None
    return Untestable("torque or speed never change sign: not separable from gain and constant load", "reversal")


GEAR_LOSSES = Effect(
    name="gear_losses",
    element=Element.SHAFT,
    title="losses of the gears",
    law="the load gets T_S - l |T_S| sign(w_L); l = l_d where T_S w_L > 0, l_b where it is not",
    source="load-dependent losses of gears: Niemann, Winter, Maschinenelemente II, 2nd ed., 2003; ISO/TR 14179-1",
    excited_by="large torques of both signs, in both directions of motion",
    parameters=(
        EffectParameter(
            "driving_share", "", 0.0, 0.0, 10.0, "share that is lost while the motor drives: l_d", most=0.5
        ),
        EffectParameter("back_share", "", 0.0, 0.0, 10.0, "share while the load drives: l_b", True, most=0.5),
    ),
    example={"driving_share": 0.1, "back_share": 0.06},
    acting=Acting(Place.SHAFT_LOSS, gears_law),
    structures=WITH_SHAFT,
    resembles=("coulomb_friction_load", "coulomb_friction_motor", "torque_nonlinearity", "inverter_gain_mismatch"),
    scales=lambda _model, _records: (0.05, 0.05),
    starts=lambda _model, _records: [(0.5, 0.5)],
    testable=gears_testable,
    text="the gears lose torque in proportion to what they transmit: {driving_share:.2%} driving, "
    "{back_share:.2%} when the load drives",
)
