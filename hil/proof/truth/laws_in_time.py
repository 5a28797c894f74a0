"""The laws that depend on the time of the recording: what begins, ends, grows or fades."""

from __future__ import annotations

import math

from hil.proof.truth.compiled import compiled
from hil.proof.truth.physics import Physics

BRAKE_RISE_S = 0.15
"""Time a brake pad takes to come on and off."""

CLUTCH_FALL_S = 0.03
"""Time a clutch takes to open."""

TIME_TO_DERATE_S = 30.0
"""A loss that grows evenly is complete by then: the length of a recording."""


@compiled
def ramp(time_s: float, at_s: float, rise_s: float) -> float:
    """Return 0 before ``at_s``, 1 from ``rise_s`` later on, evenly growing in between."""
    return min(1.0, max(0.0, (time_s - at_s) / rise_s))


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
def clutch_torque(p: Physics, time_s: float) -> float:
    """Return what the generator's clutch can hold at a time [Nm]; 0 while it is open."""
    closing = ramp(time_s, p.clutch_from_s, p.clutch_rise_s)
    opening = ramp(time_s, p.clutch_to_s, CLUTCH_FALL_S)
    return p.clutch_nm * (closing - opening)


@compiled
def stiffness_over_k(p: Physics, time_s: float, speed: float) -> float:
    """Return the shaft's stiffness over ``k`` at a time and a speed."""
    stiffness: float = 1.0 + p.stiffness_step * ramp(time_s, p.stiffness_step_at_s, p.stiffness_step_rise_s)
    if p.stiffness_speed_share != 0.0:
        fast = speed * speed
        stiffness += p.stiffness_speed_share * fast / (fast + p.stiffness_speed_rad_s * p.stiffness_speed_rad_s)
    return stiffness


@compiled
def mass_over_empty(p: Physics, time_s: float) -> float:
    """Return the load's inertia over ``J_L`` at a time."""
    mass: float = 1.0 + p.payload_share * ramp(time_s, p.payload_at_s, p.payload_rise_s)
    return mass


@compiled
def viscosity_over_warm(p: Physics, time_s: float) -> float:
    """Return the load's viscous friction over ``b_L`` at a time.

    The oil's temperature comes up exponentially, and its viscosity falls exponentially with the temperature
    (Reynolds 1886): the logarithm of the factor decays, not the factor.
    """
    if p.cold_factor == 1.0:
        return 1.0
    return math.pow(p.cold_factor, math.exp(-time_s / p.warming_time_s))


@compiled
def torque_left(p: Physics, time_s: float) -> float:
    """Return the share of the torque that is left of an inverter's reading at a time."""
    if p.derating_time_s > 0.0:
        return 1.0 + p.derating * math.expm1(-time_s / p.derating_time_s)
    return 1.0 - p.derating * ramp(time_s, 0.0, TIME_TO_DERATE_S)


@compiled
def bias_torque(p: Physics, time_s: float) -> float:
    """Return the torque that a reading lacks at a time [Nm]: a hyperbola towards its end."""
    return p.bias_nm * time_s / (time_s + p.bias_half_s)


@compiled
def is_blocked(p: Physics, time_s: float) -> bool:
    """Tell whether the inverters give no torque at a time."""
    return bool(p.dropout_every_s > 0.0 and (time_s + 0.5 * p.dropout_every_s) % p.dropout_every_s < p.dropout_s)
