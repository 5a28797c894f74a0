"""What changes with time or angle, but not with the state: set once per sub-step."""

from __future__ import annotations

import math

from estimator.compiled import inlined
from estimator.physics.effects import warming_friction
from estimator.physics.kernel import slots
from estimator.physics.kernel.state_vector import Conditions
from estimator.physics.laws import inertia_while, share_inside, wave
from estimator.signals.record import FloatArray

STICK_STABILITY = 1.5
"""Runge-Kutta is stable to h * slope / J = 2.78; friction's slope at standstill is held to about half of it."""


@inlined
def is_varying(p: FloatArray) -> bool:
    """Tell whether the conditions change within a period: an event, a law over time or over the angle."""
    events = p[slots.GENERATOR] != 0.0 or p[slots.CRACK] != 0.0 or p[slots.PAYLOAD] != 0.0 or p[slots.BRAKE] != 0.0
    ripples = p[slots.RIPPLE] != 0.0 or p[slots.RIPPLE_SHARE] != 0.0 or p[slots.IMBALANCE] != 0.0
    joints = p[slots.CARDAN] != 0.0 or p[slots.CARDAN_ANGLE] != 0.0 or p[slots.CARDAN_SHARE] != 0.0
    return bool(events or ripples or joints or p[slots.WARMING] != 0.0)


@inlined
def conditions(
    masses: int, time_s: float, h: float, angle: float, load: float, sign_width: float, p: FloatArray
) -> Conditions:
    """Return what holds during the sub-step of length ``h`` [s] from ``time_s`` on, at a motor angle [rad]."""
    coupled = share_inside(time_s, h, p[slots.GENERATOR_FROM], p[slots.GENERATOR_TO])
    cracked = share_inside(time_s, h, p[slots.CRACK_FROM], p[slots.CRACK_TO])
    loaded = share_inside(time_s, h, p[slots.PAYLOAD_FROM], p[slots.PAYLOAD_TO])
    braked = share_inside(time_s, h, p[slots.BRAKE_FROM], p[slots.BRAKE_TO])
    ripple = wave(p[slots.RIPPLE], p[slots.RIPPLE_ORDER] * angle, p[slots.RIPPLE_PHASE])
    torque_factor = 1.0 + wave(p[slots.RIPPLE_SHARE], p[slots.RIPPLE_ORDER] * angle, p[slots.RIPPLE_SHARE_PHASE])
    load += wave(p[slots.IMBALANCE], angle / p[slots.IMBALANCE_RATIO], p[slots.IMBALANCE_PHASE])
    cardan = wave(p[slots.CARDAN], 2.0 * angle, p[slots.CARDAN_PHASE])
    shaft_factor = 1.0 + wave(p[slots.CARDAN_SHARE], 2.0 * angle, p[slots.CARDAN_SHARE_PHASE])
    joint_angle = wave(p[slots.CARDAN_ANGLE], 2.0 * angle, p[slots.CARDAN_ANGLE_PHASE])
    joint_rate = 2.0 * wave(p[slots.CARDAN_ANGLE], 2.0 * angle, p[slots.CARDAN_ANGLE_PHASE] + 0.5 * math.pi)
    inertia_motor = inertia_while(p[slots.J_M], p[slots.GENERATOR], coupled)
    inertia_load = inertia_while(p[slots.J_L], p[slots.PAYLOAD], loaded) if masses > 1 else 0.0
    if masses == 1:
        inertia_motor = inertia_while(inertia_motor, p[slots.PAYLOAD], loaded)
    dry_motor = p[slots.COULOMB] + p[slots.STRIBECK] + p[slots.STRIBECK_COULOMB]
    dry_load = p[slots.COULOMB_LOAD] + braked * p[slots.BRAKE]
    wheel_inertia = p[slots.SLIP_WHEEL] * inertia_load if p[slots.SLIP] > 0.0 else inertia_load
    carried = inertia_motor if masses == 1 else wheel_inertia
    fastest = STICK_STABILITY / h
    lightest = min(inertia_motor, p[slots.J_2] if masses == 3 else carried)
    return Conditions(
        ripple,
        load,
        torque_factor,
        cardan,
        shaft_factor,
        joint_angle,
        joint_rate,
        inertia_motor,
        inertia_load,
        p[slots.K] * p[slots.LINE_SHARE] * (1.0 + cracked * p[slots.CRACK]),
        p[slots.B_L] + warming_friction.cold_part(time_s, p[slots.WARMING], p[slots.WARMING_TIME]),
        dry_load,
        max(sign_width, dry_motor / (fastest * inertia_motor)),
        max(sign_width, dry_load / (fastest * carried)),
        fastest,
        max(p[slots.YIELD], p[slots.SLIDER] / (fastest * fastest * lightest)),
    )


@inlined
def with_torque(now: Conditions, torque: float) -> Conditions:
    """Return the conditions with a torque [Nm] beside the ripple."""
    return Conditions(
        now.torque + torque * now.torque_factor,
        now.load,
        now.torque_factor,
        now.shaft_extra,
        now.shaft_factor,
        now.joint_angle,
        now.joint_rate,
        now.inertia_motor,
        now.inertia_load,
        now.stiffness,
        now.viscous_load,
        now.dry_load,
        now.width_motor,
        now.width_load,
        now.fastest,
        now.yield_twist,
    )
