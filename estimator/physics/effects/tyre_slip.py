"""The tyre slips: the wheel's inertia is coupled to the vehicle's by creep and no longer rigidly."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.lanes import choose, every
from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import WITH_SHAFT, Effect, EffectParameter, Element, Start
from estimator.physics.laws import hyperbolic_tangent
from estimator.physics.motion import speed_scale, torque_scale
from estimator.signals.record import Record

LIGHTEST = 0.005
"""Least share of the load's inertia that a wheel has."""


@compiled
def coupling(
    vehicle: float, slip_per_nm: float, creep_speed: float, wheel_share: float, steepest: float
) -> tuple[float, float]:
    """Return the torque per slide [Nm s/rad] at a vehicle speed, and the share of the inertia on the wheel's side.

    A light wheel on a steep curve follows faster than an integration step can. There it is made heavier at the
    vehicle's cost, by as much as the step needs: so near to rigid the split changes next to nothing. ``steepest`` is
    the load's inertia times the fastest decay the step can follow [Nm s/rad].
    """
    slope = 1.0 / (slip_per_nm * (abs(vehicle) + creep_speed))
    needed = slope / steepest
    enough = wheel_share * (1.0 - wheel_share) >= needed
    if every(enough):
        return slope, wheel_share
    half = 0.5 + math.copysign(math.sqrt(max(0.25 - needed, 0.0)), wheel_share - 0.5)
    return min(slope, 0.25 * steepest), choose(enough, wheel_share, half)


@compiled
def build_up(slide: float, roll: float, traction: float, tread: float, relaxation: float) -> float:
    """Return how fast the traction builds up [Nm/s]: over the angle that the tyre has to roll.

    ``tread`` is the torque per slip [Nm], ``relaxation`` what the integration step can follow at this roll [rad].
    """
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


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a per cent of slip at the torque in use, 1, a tenth of the top speed, a radian, 10 ms, and the torque."""
    torque = torque_scale(records)
    return (0.01 / torque, 1.0, 0.1 * speed_scale(records), 1.0, 0.01, torque)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return creep from small to large, at once or after rolling, for a light and a heavy wheel, far from its grip."""
    return [
        (slip, wheel, creep, relaxation, damping, 4.0)
        for slip in (0.3, 1.5)
        for wheel in (0.05, 0.15)
        for creep, relaxation, damping in ((1.0, 0.5, 0.5), (0.5, 3.0, 0.5))
    ]


def implausible(model: Driveline, records: Sequence[Record], values: Mapping[str, float]) -> str:
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


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    torque = unit("torque", motion)
    return (
        f"the tyre slips by {values['slip_per_nm']:.3g} per {torque}: {values['wheel_share']:.1%} of the load's "
        f"inertia is the wheel's, the rest follows by creep"
    )


EFFECT = Effect(
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
    loosens=frozenset({"k", "c"}),  # a carcass is a spring behind the shaft, and the tread damps its oscillation
    scales=scales,
    starts=starts,
    implausible=implausible,
    sentence=sentence,
)
