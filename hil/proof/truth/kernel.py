"""Motion of the truth's line: which torque acts on each inertia, integrated by Strang splitting.

Motor, shaft and load; next to them, where there is one, an extra inertia before or behind the shaft, and the vehicle
behind a tyre that slips (the load is then the wheels).

Half a drift (angles, bristles, relaxing torques: each solved exactly at constant speed), a kick (speeds under
the torques at fixed angles, midpoint rule for what depends on speed), half a drift: second order, and symplectic where
nothing is lost. The generator's clutch acts as an impulse at the end of a step (Moreau's time stepping), the speed
filter as the recursion of its firmware.
"""

from __future__ import annotations

import math

import numpy as np

from hil.proof.truth import laws
from hil.proof.truth.compiled import compiled
from hil.proof.truth.physics import STATES, FloatArray, Physics, StateIndex

Speeds = tuple[float, float, float, float]
"""Of motor, extra inertia, load (wheels), vehicle [rad/s]; also used for accelerations."""

MAX_STEP_S = 1e-4
"""The shaft mode (51 rad/s) moves by 0.005 rad of phase in it: relative error of its period 1e-6. Against the
closed solution the speed is right to 0.0002 rad/s, against a stiff reference of all laws to 0.002 rad/s: a
twentieth of the sensor's noise."""

FASTER = 6.0  # by how much the smaller branch of a viscoelastic shaft relaxes faster than the other


@compiled
def speeds_of(state: FloatArray) -> Speeds:
    """Return the speeds of a state, shape (STATES,)."""
    return state[StateIndex.SPEED_M], state[StateIndex.SPEED_X], state[StateIndex.SPEED_L], state[StateIndex.SPEED_V]


@compiled
def shaft_ends(p: Physics, motor: float, extra: float, load: float) -> tuple[float, float]:
    """Return what the shaft has at its driving and its driven end, of angles or of speeds."""
    if p.extra_inertia <= 0.0:
        return motor, load
    return (extra, load) if p.extra_at_motor else (motor, extra)


@compiled
def shaft_twist(state: FloatArray, p: Physics) -> tuple[float, float]:
    """Return the shaft's twist behind its Cardan joint [rad], and that joint's slope."""
    driving, driven = shaft_ends(p, state[StateIndex.ANGLE_M], state[StateIndex.ANGLE_X], state[StateIndex.ANGLE_L])
    behind, slope = laws.through_joint(p, driving)
    return behind - driven, slope


@compiled
def breakaway_limit(p: Physics, speed: float) -> float:
    """Return the motor's sliding friction at a speed over that at high speed."""
    if p.breakaway_motor_nm <= p.friction_motor_nm:
        return 1.0
    sliding = laws.sliding_torque(p.friction_motor_nm, p.breakaway_motor_nm, p.stribeck_speed_rad_s, speed)
    return sliding / p.friction_motor_nm


@compiled
def disturbance(state: FloatArray, p: Physics) -> float:
    """Return the torque against the vehicle that depends on place and time alone [Nm]."""
    hill = laws.gravity_torque(p, state[StateIndex.ANGLE_L]) * laws.mass_over_empty(p, state[StateIndex.TIME_S])
    disturbance_nm: float = p.load_torque_nm + hill
    return disturbance_nm


@compiled
def _on_motor(state: FloatArray, p: Physics, speed: float) -> float:
    """Torque on the motor inertia without the line's."""
    given = state[StateIndex.INVERTER_NM]
    torque: float = given - p.b_M * speed - p.quadratic_motor * speed * abs(speed) - laws.eddy_torque(p, speed)
    torque -= laws.torque_by_direction(p, speed)
    torque += laws.ripple_torque(p, state[StateIndex.ANGLE_M], given)
    if p.friction_motor_nm > 0.0:
        limit = breakaway_limit(p, speed)
        torque -= laws.friction_torque(p.friction_motor_nm, limit, state[StateIndex.BRISTLE_M], speed)
    return torque


@compiled
def _on_load(state: FloatArray, p: Physics, speed: float) -> float:
    """Torque of wheels, axle, bearings and brake on the load inertia."""
    torque = -p.b_L * laws.viscosity_over_warm(p, state[StateIndex.TIME_S]) * speed
    torque -= laws.imbalance_torque(p, state[StateIndex.ANGLE_L])
    held = p.friction_load_nm + laws.brake_torque(p, state[StateIndex.TIME_S])
    if held > 0.0:
        torque -= laws.friction_torque(held, 1.0, state[StateIndex.BRISTLE_L], speed)
    return torque


@compiled
def _through_shaft(state: FloatArray, p: Physics, speeds: Speeds) -> tuple[float, float]:
    """Torque at the shaft's driving and at its driven end."""
    motor, extra, load, _ = speeds
    twist, slope = shaft_twist(state, p)
    driving, driven = shaft_ends(p, motor, extra, load)
    stiffness = laws.stiffness_over_k(p, state[StateIndex.TIME_S], driving)
    slider_nm = laws.slider_torque(state[StateIndex.SLIDERS : STATES], p) if p.hysteresis_stiffness > 0.0 else 0.0
    torque: float = laws.shaft_torque(p, twist, slope * driving - driven, stiffness, slider_nm)
    torque += state[StateIndex.MAXWELL_NM] + state[StateIndex.MAXWELL_FAST_NM]
    return slope * torque, laws.behind_gears(p, torque, driven)


@compiled
def _of_wheels_and_vehicle(
    state: FloatArray, p: Physics, wheels_nm: float, vehicle_nm: float, speeds: Speeds
) -> tuple[float, float]:
    """Accelerations of the wheels and of the vehicle, which are one where the tyre can't slip."""
    _, _, wheels, vehicle = speeds
    inertia = p.J_L * laws.mass_over_empty(p, state[StateIndex.TIME_S])
    if p.wheel_inertia <= 0.0:
        both = (wheels_nm + vehicle_nm) / inertia
        return both, both
    tyre_nm = laws.tyre_torque(p, state[StateIndex.SLIP], wheels, vehicle)
    return (wheels_nm - tyre_nm) / p.wheel_inertia, (tyre_nm + vehicle_nm) / (inertia - p.wheel_inertia)


@compiled
def _through_link(state: FloatArray, p: Physics, speeds: Speeds) -> float:
    """Torque through the spring between the extra inertia and the motor, or the load."""
    motor, extra, load, _ = speeds
    if p.extra_at_motor:
        twist, rate = state[StateIndex.ANGLE_M] - state[StateIndex.ANGLE_X], motor - extra
    else:
        twist, rate = state[StateIndex.ANGLE_X] - state[StateIndex.ANGLE_L], extra - load
    torque: float = p.extra_stiffness * twist + p.extra_damping * rate
    return torque


@compiled
def accelerations(state: FloatArray, p: Physics, disturbance_nm: float, speeds: Speeds) -> Speeds:
    """Return the accelerations [rad/s^2] at the state's angles and at speeds that may be others than its own."""
    motor, _, load, vehicle = speeds
    driving_nm, driven_nm = _through_shaft(state, p, speeds)
    from_motor, to_load, of_extra = driving_nm, driven_nm, 0.0
    if p.extra_inertia > 0.0:
        link_nm = _through_link(state, p, speeds)
        if p.extra_at_motor:
            from_motor, of_extra = link_nm, (link_nm - driving_nm) / p.extra_inertia
        else:
            to_load, of_extra = link_nm, (driven_nm - link_nm) / p.extra_inertia
    of_motor = (_on_motor(state, p, motor) - from_motor) / (p.J_M * laws.inertia_over_rotor(p, motor))
    on_vehicle = -disturbance_nm - p.quadratic_load * vehicle * abs(vehicle)
    of_load, of_vehicle = _of_wheels_and_vehicle(state, p, to_load + _on_load(state, p, load), on_vehicle, speeds)
    return of_motor, of_extra, of_load, of_vehicle


@compiled
def _turn(state: FloatArray, p: Physics, h: float) -> None:
    """Move the angles, and what follows them directly."""
    before, _ = shaft_twist(state, p)
    state[StateIndex.ANGLE_M] += state[StateIndex.SPEED_M] * h
    state[StateIndex.ANGLE_X] += state[StateIndex.SPEED_X] * h
    state[StateIndex.ANGLE_L] += state[StateIndex.SPEED_L] * h
    if p.hysteresis_stiffness > 0.0:
        behind, _ = shaft_twist(state, p)
        change = laws.beyond_gap(p, behind) - laws.beyond_gap(p, before)
        laws.follow_twist(state[StateIndex.SLIDERS : STATES], p, change)


@compiled
def _relax(state: FloatArray, p: Physics, h: float) -> None:
    """Move what approaches a value that the speeds set."""
    speed_m, speed_l = state[StateIndex.SPEED_M], state[StateIndex.SPEED_L]
    if p.friction_motor_nm > 0.0:
        limit = breakaway_limit(p, speed_m)
        state[StateIndex.BRISTLE_M] = laws.bristle_after(state[StateIndex.BRISTLE_M], speed_m, limit, h)
    if p.brake_nm > 0.0 or p.friction_load_nm > 0.0:
        state[StateIndex.BRISTLE_L] = laws.bristle_after(state[StateIndex.BRISTLE_L], speed_l, 1.0, h)
    if p.maxwell_stiffness > 0.0:
        driving, driven = shaft_ends(p, speed_m, state[StateIndex.SPEED_X], speed_l)
        steady = p.maxwell_stiffness * p.maxwell_time_s * (driving - driven)
        state[StateIndex.MAXWELL_NM] = steady + (state[StateIndex.MAXWELL_NM] - steady) * math.exp(
            -h / p.maxwell_time_s
        )
        quick = p.maxwell_fast_share * steady / FASTER
        left = math.exp(-h * FASTER / p.maxwell_time_s)
        state[StateIndex.MAXWELL_FAST_NM] = quick + (state[StateIndex.MAXWELL_FAST_NM] - quick) * left
    if p.wheel_inertia > 0.0:
        state[StateIndex.SLIP] = laws.slip_after(state[StateIndex.SLIP], p, speed_l, state[StateIndex.SPEED_V], h)


@compiled
def _drift(state: FloatArray, p: Physics, command_nm: float, h: float) -> None:
    _turn(state, p, h)
    _relax(state, p, h)
    state[StateIndex.TIME_S] += h
    if p.current_loop_time_s > 0.0:
        error = state[StateIndex.INVERTER_NM] - command_nm
        state[StateIndex.INVERTER_NM] = command_nm + error * math.exp(-h / p.current_loop_time_s)
    elif p.slew_nm_s > 0.0:
        change = command_nm - state[StateIndex.INVERTER_NM]
        state[StateIndex.INVERTER_NM] += min(p.slew_nm_s * h, max(-p.slew_nm_s * h, change))
    else:
        state[StateIndex.INVERTER_NM] = command_nm


@compiled
def _kick(state: FloatArray, p: Physics, h: float) -> None:
    outer = disturbance(state, p)
    motor, extra, load, vehicle = speeds_of(state)
    half = 0.5 * h
    of_m, of_x, of_l, of_v = accelerations(state, p, outer, (motor, extra, load, vehicle))
    middle = (motor + half * of_m, extra + half * of_x, load + half * of_l, vehicle + half * of_v)
    of_m, of_x, of_l, of_v = accelerations(state, p, outer, middle)
    state[StateIndex.SPEED_M] = motor + h * of_m
    state[StateIndex.SPEED_X] = extra + h * of_x
    state[StateIndex.SPEED_L] = load + h * of_l
    state[StateIndex.SPEED_V] = vehicle + h * of_v


@compiled
def _couple_generator(state: FloatArray, p: Physics, h: float) -> None:
    """Bring motor and generator together as far as the clutch holds; the impulse that would is exact.

    With the clutch open the generator is kept near the motor's speed by its own control.
    """
    clutch_nm = laws.clutch_torque(p, state[StateIndex.TIME_S])
    motor, generator = state[StateIndex.SPEED_M], state[StateIndex.SPEED_G]
    if clutch_nm <= 0.0:
        state[StateIndex.SPEED_G] = (1.0 - p.generator_lag) * motor
        return
    together = (motor - generator) * p.J_M * p.generator_inertia / (p.J_M + p.generator_inertia)
    impulse = min(clutch_nm * h, max(-clutch_nm * h, together))
    state[StateIndex.SPEED_M] = motor - impulse / p.J_M
    state[StateIndex.SPEED_G] = generator + impulse / p.generator_inertia


@compiled
def _filter_speed(state: FloatArray, p: Physics, h: float) -> None:
    """One cycle of the speed filter: backward Euler (first order), semi-implicit Euler (second order)."""
    speed = laws.resolver_speed(p, state[StateIndex.ANGLE_M], state[StateIndex.SPEED_M])
    if p.filter_time_s > 0.0:
        state[StateIndex.FILTERED] += h / (p.filter_time_s + h) * (speed - state[StateIndex.FILTERED])
    else:
        pull = speed - state[StateIndex.FILTERED] - 2.0 * p.filter_damping * state[StateIndex.FILTERED_RATE]
        state[StateIndex.FILTERED_RATE] += h * p.filter_rad_s * pull
        state[StateIndex.FILTERED] += h * p.filter_rad_s * state[StateIndex.FILTERED_RATE]


@compiled
def advance(state: FloatArray, p: Physics, command_nm: float, duration_s: float) -> None:
    """Move the state on by ``duration_s`` under a constant torque command."""
    steps = math.ceil(duration_s / MAX_STEP_S - 1e-9)
    if steps < 1:
        return
    h = duration_s / steps
    for _ in range(steps):
        _drift(state, p, command_nm, 0.5 * h)
        _kick(state, p, h)
        _drift(state, p, command_nm, 0.5 * h)
        if p.generator_inertia > 0.0:
            _couple_generator(state, p, h)
        if p.filter_time_s > 0.0 or p.filter_rad_s > 0.0:
            _filter_speed(state, p, h)


@compiled
def course(state: FloatArray, p: Physics, commands_nm: FloatArray, durations_s: FloatArray) -> FloatArray:
    """Move the state on by one command after the other, shapes (N,); return it after each, shape (N, STATES)."""
    after = np.empty((durations_s.size, state.size))
    for i in range(durations_s.size):
        advance(state, p, commands_nm[i], durations_s[i])
        after[i] = state
    return after
