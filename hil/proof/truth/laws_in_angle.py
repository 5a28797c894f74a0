"""The laws that depend on where a shaft, a wheel or the vehicle stands."""

from __future__ import annotations

import math

from hil.proof.truth.compiled import compiled
from hil.proof.truth.physics import Physics

RIPPLE_OVERTONE = 0.2
"""Second harmonic of the torque ripple over the first: no machine's ripple is a pure sine."""


@compiled
def gravity_torque(p: Physics, angle_load: float) -> float:
    """Return the torque of the hill the vehicle stands on [Nm], positive uphill."""
    slope = 0.0
    x = p.road_start_m + p.metres_per_rad * angle_load
    for wave in range(p.road.shape[0]):
        number = p.road[wave, 1]
        slope += p.road[wave, 0] * number * math.cos(number * x + p.road[wave, 2])
    return p.gravity_nm * slope / math.sqrt(1.0 + slope * slope)


@compiled
def ripple_torque(p: Physics, angle_motor: float, torque_nm: float) -> float:
    """Return what the motor gives beyond the mean torque of a turn [Nm]."""
    size = p.ripple_nm + p.ripple_share * torque_nm
    if size == 0.0:
        return 0.0
    angle = p.ripple_order * angle_motor + p.ripple_phase_rad
    return size * (math.sin(angle) + RIPPLE_OVERTONE * math.sin(2.0 * angle + 1.0))


@compiled
def imbalance_torque(p: Physics, angle_load: float) -> float:
    """Return the torque against the load of a heavy spot and of an oval wheel [Nm]."""
    if p.imbalance_nm == 0.0 and p.imbalance_twice_nm == 0.0:
        return 0.0
    angle = angle_load / p.gear_ratio + p.imbalance_phase_rad
    return p.imbalance_nm * math.sin(angle) + p.imbalance_twice_nm * math.sin(2.0 * angle + 0.7)


@compiled
def through_joint(p: Physics, angle: float) -> tuple[float, float]:
    """Return the angle behind a Cardan joint and its slope, speed behind over speed before.

    ``tan(behind) = cos(bend) tan(before)``, whose slope is ``cos(bend) / (1 - sin^2(bend) sin^2(before))``.
    """
    if p.joint_angle_rad == 0.0:
        return angle, 1.0
    bend = math.cos(p.joint_angle_rad)
    s, c = math.sin(angle + p.joint_phase_rad), math.cos(angle + p.joint_phase_rad)
    lead = math.atan((bend - 1.0) * s * c / (c * c + bend * s * s))
    return angle + lead, bend / (c * c + bend * bend * s * s)


@compiled
def resolver_speed(p: Physics, angle_motor: float, speed_motor: float) -> float:
    """Return the rate of the angle the resolver believes in [rad/s]."""
    slope = p.resolver_once_rad * math.cos(angle_motor + p.resolver_once_phase_rad)
    slope += 2.0 * p.resolver_twice_rad * math.cos(2.0 * angle_motor + p.resolver_twice_phase_rad)
    return speed_motor * (1.0 + slope)
