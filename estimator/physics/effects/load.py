"""Load torques beyond a constant one: road, imbalance, gravity, a spring to the ground, and the tyre."""

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
    Place,
    Untestable,
)
from estimator.physics.laws import hyperbolic_tangent
from estimator.physics.motion import range_of, speed_scale, torque_scale
from estimator.signals.record import FloatArray, Record

# Road grade: a load torque that wanders slowly over a recording, as the road goes up and down.


KNOT_SPACING_S = 2.0  # a road's grade keeps its value over tens of metres: 2 s at a bus's 10 m/s are 20 m
DEGREE = 3  # cubic: a road is laid out without kinks, so a profile with an edge is something else

SHORTEST_S = 4 * KNOT_SPACING_S
"""A profile needs a few knots; a shorter recording can't tell it from the constant load."""

SWINGS_RAD = (1.0, 2.0, 4.0, 8.0)
"""Ranges of the load's angle from which a fit starts where the gear ratio is not known."""

LIGHTEST = 0.005  # least share of the load's inertia that a wheel has


def grade_basis(time_s: FloatArray, at_s: FloatArray | None = None) -> FloatArray:
    """Return the profile's basis: cubic B-splines, the first left out (their sum is the constant load)."""
    from scipy.interpolate import BSpline  # a third of a second that few need

    first, last = float(time_s[0]), float(time_s[-1])
    inner = np.linspace(first, last, max(2, round((last - first) / KNOT_SPACING_S) + 1))
    knots = np.concatenate([[first] * DEGREE, inner, [last] * DEGREE])
    at = time_s if at_s is None else at_s
    design = BSpline.design_matrix(np.clip(at, first, last), knots, DEGREE).toarray()
    return np.ascontiguousarray(design.T[1:])


def grade_testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need a recording that is long enough for a slow profile to differ from a constant load."""
    if any(record.time_s[-1] - record.time_s[0] >= SHORTEST_S for record in records):
        return None
    return Untestable(
        f"every recording is shorter than {SHORTEST_S:g} s: a slow profile is not separable from a constant load",
        "cruise",
    )


ROAD_GRADE = Effect(
    name="road_grade",
    element=Element.LOAD,
    title="road grade",
    law="T_load = T_0 + g(t), g a cubic spline over time",
    source="gravity on a slope, m g sin(grade): Gillespie, Fundamentals of Vehicle Dynamics, SAE 1992",
    excited_by="driving on a road that is not level",
    parameters=(EffectParameter("grade_rms_nm", "torque", 0.0, 0.0, float("inf"), "size of the profile: its rms"),),
    structures=EVERY_LINE,
    resembles=(
        "torque_derating",
        "aerodynamic_drag",
        "brake_drag",
        "load_imbalance",
        "inertia_change",
        "warming_friction",
    ),
    scales=lambda _model, records: (0.05 * torque_scale(records),),
    starts=lambda _model, _records: [(0.0,)],
    testable=grade_testable,
    text="the load torque varies slowly by {grade_rms_nm:.3g} {unit[torque]} (rms), as on a road with grades",
    profile=True,
)


# Gravity on a load that is not balanced: an arm, a pendulum, a door.


@compiled
def gravity_law(angle: float, moment: float, turns: float, phase: float) -> float:
    """Return ``G sin(phi_M / i + alpha)`` [Nm], against the load."""
    if every(moment == 0.0):
        return 0.0
    return moment * math.sin(angle / turns + phase)


def gravity_scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a fifth of the torque in use, and the gear ratio, or that with which the load swings by a radian."""
    return (0.2 * torque_scale(records), model.gear_ratio or max(range_of(records), 1.0))


def gravity_starts(model: Driveline, records: Sequence[Record]) -> list[FitStart]:
    """Return one start for each gear ratio that may be; the problem is linear in moment and phase together."""
    if model.gear_ratio is not None:
        return [(1.0, Held(1.0))]
    return [(1.0, 1.0 / swing) for swing in SWINGS_RAD]


def gravity_implausible(model: Driveline, records: Sequence[Record], values: Mapping[str, float]) -> str:
    """Object to a moment that is more than all torque that was applied."""
    swing = min(range_of(records) / values["motor_turns_per_turn"], 2.0 * math.pi)
    most = max(float(np.abs(record.total_torque_nm).max()) for record in records)
    if values["moment_nm"] * (1.0 - math.cos(0.5 * swing)) <= 2.0 * most:
        return ""
    return f"{values['moment_nm']:.3g} Nm over {swing:.2g} rad is more than all torque that was applied"


def gravity_sentence(values: Mapping[str, float], motion: Motion) -> str:
    """State the moment, and the gear ratio where it is not 1."""
    turns = values["motor_turns_per_turn"]
    geared = f", {turns:.3g} motor turns to one turn of the load" if turns != 1.0 else ""
    return f"gravity pulls at the load with up to {values['moment_nm']:.3g} {unit('torque', motion)}{geared}"


GRAVITY = Effect(
    name="gravity",
    element=Element.LOAD,
    title="gravity on an unbalanced load",
    law="T_load = T_0 + G sin(phi_M / i + alpha)",
    source="Siciliano, Sciavicco, Villani, Oriolo, Robotics, Springer 2009, ch. 7",
    excited_by="slow motion over a wide range of angles",
    parameters=(
        EffectParameter("moment_nm", "torque", 0.0, 0.0, 50.0, "largest moment of gravity: G"),
        EffectParameter("motor_turns_per_turn", "", 1.0, 0.05, 10.0, "motor turns per turn of the load: i", True),
        EffectParameter("phase_rad", "rad", 0.0, -10.0, 10.0, "angle at the start from hanging: alpha", True, True),
    ),
    example={"moment_nm": 60.0, "motor_turns_per_turn": 3.0},
    acting=Acting(Place.RECORDED_ANGLE, gravity_law),
    structures=EVERY_LINE,
    resembles=("load_imbalance", "road_grade", "torque_ripple"),
    contains=("grounded_spring",),  # over a small part of a turn
    phases={"phase_rad": "moment_nm"},
    scales=gravity_scales,
    starts=gravity_starts,
    implausible=gravity_implausible,
    text=gravity_sentence,
    waving=True,
    swinging=True,
)


# A spring between the load and the ground: a return spring, a bellows, a cable that is wound up.


@compiled
def ground_law(angle: float, stiffness: float) -> float:
    """Return ``k_g phi``; where the spring is slack is part of the constant load torque [Nm]."""
    return stiffness * angle


def ground_sentence(values: Mapping[str, float], motion: Motion) -> str:
    """State the stiffness to the ground."""
    size = f"{values['stiffness_nm_per_rad']:.3g} {unit('stiffness', motion)}"
    return f"a spring of {size} holds the load against the ground"


GROUNDED_SPRING = Effect(
    name="grounded_spring",
    element=Element.LOAD,
    title="spring to the ground",
    law="T_load = T_0 + k_g phi_L",
    source="Den Hartog, Mechanical Vibrations, 4th ed., 1956, ch. 2",
    excited_by="motion to and fro over a wide range, slow enough to feel it",
    parameters=(EffectParameter("stiffness_nm_per_rad", "stiffness", 0.0, 0.0, 100.0, "stiffness of the spring: k_g"),),
    example={"stiffness_nm_per_rad": 40.0},
    acting=Acting(Place.LOAD_ANGLE, ground_law),
    structures=EVERY_LINE,
    resembles=("gravity", "road_grade"),
    scales=lambda _model, records: (torque_scale(records) / max(0.5 * range_of(records), np.finfo(float).tiny),),
    starts=lambda _model, _records: [(float(share),) for share in np.geomspace(0.03, 2.0, 9)],
    text=ground_sentence,
    linear=True,
    swinging=True,
)


# The tyre slips: the wheel's inertia is coupled to the vehicle's by creep and no longer rigidly.


@compiled
def coupling(
    vehicle: float, slip_per_nm: float, creep_speed: float, wheel_share: float, steepest: float
) -> tuple[float, float]:
    """Return the torque per slide [Nm s/rad] at a vehicle speed, and the share of the inertia on the wheel's side."""
    slope = 1.0 / (slip_per_nm * (abs(vehicle) + creep_speed))
    needed = slope / steepest
    enough = wheel_share * (1.0 - wheel_share) >= needed
    if every(enough):
        return slope, wheel_share
    half = 0.5 + math.copysign(math.sqrt(max(0.25 - needed, 0.0)), wheel_share - 0.5)
    return min(slope, 0.25 * steepest), choose(enough, wheel_share, half)


@compiled
def build_up(slide: float, roll: float, traction: float, tread: float, relaxation: float) -> float:
    """Return how fast the traction builds up [Nm/s]: over the angle that the tyre has to roll."""
    return (slide * tread - roll * traction) / relaxation


@compiled
def carcass(slide: float, vehicle: float, winding: float, inverse_creep: float) -> float:
    """Return the torque by which the carcass damps its wind-up [Nm], near standstill where rolling can't relax it."""
    crept = vehicle * inverse_creep
    return winding * slide / (1.0 + crept * crept)


@compiled
def gripped(traction: float, grip: float, inverse_grip: float) -> float:
    """Return the torque that a tyre passes on [Nm], of what it would without an end to its grip."""
    if every(inverse_grip == 0.0):
        return traction
    return choose(inverse_grip == 0.0, traction, grip * hyperbolic_tangent(traction * inverse_grip))


def tyre_scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a per cent of slip at the torque in use, 1, a tenth of the top speed, a radian, 10 ms, and the torque."""
    torque = torque_scale(records)
    return (0.01 / torque, 1.0, 0.1 * speed_scale(records), 1.0, 0.01, torque)


def tyre_starts(model: Driveline, records: Sequence[Record]) -> list[FitStart]:
    """Return creep from small to large, at once or after rolling, for a light and a heavy wheel, far from its grip."""
    return [
        (slip, wheel, creep, relaxation, damping, 4.0)
        for slip in (0.3, 1.5)
        for wheel in (0.05, 0.15)
        for creep, relaxation, damping in ((1.0, 0.5, 0.5), (0.5, 3.0, 0.5))
    ]


def tyre_implausible(model: Driveline, records: Sequence[Record], values: Mapping[str, float]) -> str:
    """Object to a wheel so light that nothing tells it from a damper at the vehicle, and to a carcass at speed.

    A carcass that damps its wind-up at every speed is a spring with a damper: an elastic line, but no rolling tyre.
    """
    if values["wheel_share"] <= 1.1 * LIGHTEST:
        return f"a wheel with {values['wheel_share']:.1%} of the load's inertia is lighter than any"
    top = speed_scale(records)
    if values.get("relaxation_rad", 0.0) > 0.0 and values["creep_rad_s"] > top:
        return (
            f"its carcass would act as at standstill up to {values['creep_rad_s']:.3g} {unit('speed', model.motion)}, "
            f"beyond the top speed of {top:.3g}: a spring and a damper, no tyre that rolls"
        )
    return ""


TYRE_SLIP = Effect(
    name="tyre_slip",
    element=Element.LOAD,
    title="slip of the tyre",
    law="J_W dw_W/dt = T_S - T_x, J_V dw_V/dt = T_x - b_L w_V - T_load, "
    "T_x = (w_W - w_V) / (s (|w_V| + w_0)); or T_x = T_l + t_c (w_W - w_V) / (s l (1 + (w_V/w_0)^2)), "
    "l dT_l/dt + |w_V| T_l = (w_W - w_V) / s; of either the tyre passes on G tanh(T_x / G)",
    source="slip, grip, relaxation, standstill: Pacejka, Tire and Vehicle Dynamics, 3rd ed., 2012, ch. 4, 7, 8.6",
    excited_by="large torque changes: tip-in, tip-out, PRBS",
    parameters=(
        EffectParameter("slip_per_nm", "per_torque", 0.0, 0.0, 100.0, "slip per torque: s"),
        EffectParameter(
            "wheel_share", "", 0.05, LIGHTEST, 0.7, "share of J_L that is the wheel's: J_W / J_L", True, most=0.99
        ),
        EffectParameter("creep_rad_s", "speed", 1.0, 0.1, 20.0, "speed below which slip is a slide: w_0", True),
        EffectParameter("relaxation_rad", "angle", 0.0, 0.05, 100.0, "angle over which traction builds up: l", True),
        EffectParameter("carcass_s", "s", 0.0, 0.0, 20.0, "damping of the carcass at standstill: t_c", True),
        EffectParameter("grip_nm", "torque", math.inf, 0.6, 20.0, "torque at which the tyre slides: G", True),
    ),
    structures=WITH_SHAFT,
    resembles=("extra_torsional_mode",),
    widens=frozenset({"k", "c"}),  # a carcass is a spring behind the shaft, and the tread damps its oscillation
    scales=tyre_scales,
    starts=tyre_starts,
    implausible=tyre_implausible,
    text="the tyre slips by {slip_per_nm:.3g} per {unit[torque]}: {wheel_share:.1%} of the load's inertia "
    "is the wheel's, the rest follows by creep",
)
