"""The laws of friction and of the shaft: what torque follows from speed and twist."""

from __future__ import annotations

import math

from hil.proof.truth.compiled import compiled
from hil.proof.truth.physics import Physics

PRESLIDING_RAD = 1e-3
"""Bristle deflection at which sliding starts: up to a tenth of a degree is usual for seals and bearings."""

MICRO_DAMPING_S = 1e-2
MICRO_DAMPING_SPEED_RAD_S = 0.1
"""Bristle damping dies away with speed, or LuGre friction overshoots several times at a fast reversal."""


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
def beyond_gap(p: Physics, twist: float) -> float:
    """Return the part of a twist that loads the shaft."""
    if abs(twist) <= 0.5 * p.gap_rad:
        return 0.0
    return twist - math.copysign(0.5 * p.gap_rad, twist)


@compiled
def shaft_torque(
    p: Physics, twist: float, twist_rate: float, stiffness_over_k: float = 1.0, hysteresis_nm: float = 0.0
) -> float:
    """Return the torque through the shaft [Nm]; a gap has two contacts that can press and never pull."""
    loaded = beyond_gap(p, twist)
    torque = stiffness_over_k * characteristic(p, loaded) + p.c * twist_rate + hysteresis_nm
    if p.gap_rad <= 0.0:
        return torque
    side = (loaded > 0.0) - (loaded < 0.0)
    return side * max(0.0, side * torque)


@compiled
def eddy_torque(p: Physics, speed: float) -> float:
    """Return the drag of eddy currents [Nm]: it is greatest at one speed and falls beyond."""
    if p.eddy_nm == 0.0 or speed == 0.0:
        return 0.0
    over = math.pow(abs(speed) / p.eddy_speed_rad_s, p.eddy_exponent)
    return math.copysign(p.eddy_nm * 2.0 / (over + 1.0 / over), speed)


@compiled
def inertia_over_rotor(p: Physics, speed: float) -> float:
    """Return the motor's inertia, with what it draws along at a speed, over its own."""
    square = (speed / p.drawn_half_rad_s) ** 2
    return 1.0 + p.drawn_share * square / (1.0 + square)


STANDSTILL_RAD_S = 0.02
"""Speed within which a torque that depends on the direction changes over."""


@compiled
def torque_by_direction(p: Physics, speed: float) -> float:
    """Return what friction at the motor holds more forward than it would, or less backward [Nm]."""
    return p.viscous_forward * abs(speed) + p.dry_forward_nm * math.tanh(speed / STANDSTILL_RAD_S) ** 2


@compiled
def behind_gears(p: Physics, torque_nm: float, speed: float) -> float:
    """Return what gears make of the torque at their driving side [Nm], at a speed of both."""
    if p.efficiency == 1.0 and p.efficiency_back == 1.0:
        return torque_nm
    driving = torque_nm * speed > 0.0
    behind = torque_nm * p.efficiency if driving else torque_nm / p.efficiency_back
    return torque_nm + (behind - torque_nm) * abs(math.tanh(speed / STANDSTILL_RAD_S))
