"""Laws of the truth: what torque follows from speed, twist, angle and time."""

from __future__ import annotations

import math

from hil.proof.truth.compiled import compiled
from hil.proof.truth.physics import ELEMENTS, FloatArray, Physics

PRESLIDING_RAD = 1e-3
"""Bristle deflection at which sliding starts: up to a tenth of a degree is usual for seals and bearings."""

MICRO_DAMPING_S = 1e-2
MICRO_DAMPING_SPEED_RAD_S = 0.1
"""Bristle damping dies away with speed, or LuGre friction overshoots several times at a fast reversal."""

STANDSTILL_RAD_S = 0.02  # speed within which a torque that depends on the direction changes over

RIPPLE_OVERTONE = 0.2
"""Second harmonic of the torque ripple over the first: no machine's ripple is a pure sine."""

BRAKE_RISE_S = 0.15  # time a brake pad takes to come on and off
CLUTCH_FALL_S = 0.03  # time a clutch takes to open
TIME_TO_DERATE_S = 30.0  # a loss that grows evenly is complete by then: the length of a recording

TYRE_SHAPE = 1.6  # shape factor of the magic formula for longitudinal slip

STANDSTILL_DAMPING_S = 0.01
STANDSTILL_SPEED_RAD_S = 5.0
"""The carcass damps the wheel's wind-up near standstill, where rolling can't relax it: damping over the contact's
stiffness, and the speed at which rolling takes over (Pacejka, section 8.6)."""


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


@compiled
def slip_after(slip: float, p: Physics, speed_wheel: float, speed_vehicle: float, time_s: float) -> float:
    """Return the slip after ``time_s`` at constant speeds; exact solution of ``s dk/dt = v_w - v_v - |v_v| k``."""
    rate = abs(speed_vehicle) / p.relaxation_rad
    sliding = (speed_wheel - speed_vehicle) / p.relaxation_rad
    decay = -math.expm1(-rate * time_s)
    if decay < 1e-9:
        return slip + sliding * time_s
    return slip + (sliding / rate - slip) * decay


@compiled
def tyre_torque(p: Physics, slip: float, speed_wheel: float, speed_vehicle: float) -> float:
    """Return the torque from wheel to vehicle [Nm]."""
    rolling = 1.0 + (speed_vehicle / STANDSTILL_SPEED_RAD_S) ** 2
    damped = slip + STANDSTILL_DAMPING_S * (speed_wheel - speed_vehicle) / (p.relaxation_rad * rolling)
    return p.grip_nm * math.sin(TYRE_SHAPE * math.atan(p.slip_stiffness_nm / (TYRE_SHAPE * p.grip_nm) * damped))


@compiled
def follow_twist(deflections: FloatArray, p: Physics, twist_change: float) -> None:
    """Let the elements follow a change of the twist; exact, however large. ``deflections`` has shape (ELEMENTS,)."""
    for element in range(ELEMENTS):
        limit = p.hysteresis_slip_rad * (element + 1.0) / ELEMENTS
        deflections[element] = min(limit, max(-limit, deflections[element] + twist_change))


@compiled
def slider_torque(deflections: FloatArray, p: Physics) -> float:
    """Return the torque of all elements together [Nm]."""
    deflection = 0.0
    for element in range(ELEMENTS):
        deflection += deflections[element]
    return p.hysteresis_stiffness * deflection / ELEMENTS
