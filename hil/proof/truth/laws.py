"""The laws: what torque acts between and on the two inertias."""

from __future__ import annotations

import math

from hil.proof.truth.compiled import compiled
from hil.proof.truth.physics import Physics

PRESLIDING_RAD = 1e-3
"""Bristle deflection at which sliding starts: up to a tenth of a degree is usual for seals and bearings."""

MICRO_DAMPING_S = 1e-2
MICRO_DAMPING_SPEED_RAD_S = 0.1
"""Bristle damping dies away with speed, or LuGre friction overshoots several times at a fast reversal."""

BRAKE_RISE_S = 0.15
"""Time a brake pad takes to come on and off."""


@compiled
def sliding_torque(kinetic_nm: float, breakaway_nm: float, stribeck_speed: float, speed: float) -> float:
    """Return the friction torque while sliding steadily at ``speed``: the Stribeck curve [Nm]."""
    if breakaway_nm <= kinetic_nm:
        return kinetic_nm
    return kinetic_nm + (breakaway_nm - kinetic_nm) * math.exp(-((speed / stribeck_speed) ** 2))


@compiled
def bristle_after(bristle: float, speed: float, limit: float, time_s: float) -> float:
    """Return the bristle deflection after ``time_s`` at constant ``speed``, in presliding angles.

    Exact solution of ``dz/dt = (v - |v| z / limit) / presliding``, so that no step is too long for it.
    """
    rate = abs(speed) / (PRESLIDING_RAD * limit)
    decay = -math.expm1(-rate * time_s)
    if decay < 1e-9:
        return bristle + speed * time_s / PRESLIDING_RAD
    return bristle + (math.copysign(limit, speed) - bristle) * decay


@compiled
def friction_torque(kinetic_nm: float, limit: float, bristle: float, speed: float) -> float:
    """Return the LuGre friction torque [Nm] of a bristle at a speed."""
    bristle_rate = (speed - abs(speed) * bristle / limit) / PRESLIDING_RAD
    damping = MICRO_DAMPING_S / (1.0 + (speed / MICRO_DAMPING_SPEED_RAD_S) ** 2)
    return kinetic_nm * (bristle + damping * bristle_rate)


@compiled
def characteristic(p: Physics, twist: float) -> float:
    """Return the elastic torque of a twist [Nm]: linear, hardening or softening."""
    if p.hardening_twist_rad > 0.0:
        return p.k * p.hardening_twist_rad * math.sinh(twist / p.hardening_twist_rad)
    if p.softening_twist_rad > 0.0:
        return p.k * p.softening_twist_rad * math.asinh(twist / p.softening_twist_rad)
    return p.k * twist


@compiled
def shaft_torque(p: Physics, twist: float, twist_rate: float) -> float:
    """Return the torque through the shaft [Nm]; a gap has two contacts that can press and never pull."""
    if p.gap_rad <= 0.0:
        return characteristic(p, twist) + p.c * twist_rate
    depth = abs(twist) - 0.5 * p.gap_rad
    if depth <= 0.0:
        return 0.0
    side = math.copysign(1.0, twist)
    return side * max(0.0, characteristic(p, depth) + p.c * twist_rate * side)


@compiled
def brake_torque(p: Physics, time_s: float) -> float:
    """Return what the brake can hold at a time [Nm]: a trapezoid in every period."""
    if p.brake_nm <= 0.0:
        return 0.0
    t = time_s % p.brake_period_s
    rise = (t - p.brake_from_s) / BRAKE_RISE_S
    fall = (p.brake_to_s - t) / BRAKE_RISE_S
    return p.brake_nm * min(1.0, max(0.0, min(rise, fall)))


@compiled
def gravity_torque(p: Physics, angle_load: float) -> float:
    """Return the torque of the hill the vehicle stands on [Nm], positive uphill."""
    slope = 0.0
    x = p.road_start_m + p.metres_per_rad * angle_load
    for wave in range(p.road.shape[0]):
        number = p.road[wave, 1]
        slope += p.road[wave, 0] * number * math.cos(number * x + p.road[wave, 2])
    return p.gravity_nm * slope / math.sqrt(1.0 + slope * slope)
