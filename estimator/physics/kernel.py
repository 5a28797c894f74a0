"""The one compiled driveline simulation, with the law of every effect at its place.

Chain of one sub-step: torque on the shaft -> delay -> lag -> motor -> shaft -> load -> sensor. Fixed-step Runge-Kutta
of fourth order; the torque of a sub-step is the exact mean of the delayed, lagged, zero-order-held input over it. What
changes with time or angle, but not with the state, is set once per sub-step.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from estimator.compiled import brief, compiled, inlined
from estimator.physics.effects import (
    actuator_lag,
    aerodynamic_drag,
    backlash,
    resolver_error,
    shaft_hysteresis,
    speed_filter,
    stiffness_nonlinearity,
    stribeck_friction,
    transport_delay,
    tyre_slip,
    warming_friction,
)
from estimator.physics.laws import beyond_gap, dry_friction, inertia_while, share_inside, wave
from estimator.physics.layout import slot
from estimator.signals.record import FloatArray

ANGLE, SPEED, TWIST, LOAD_SPEED = 0, 1, 2, 3
"""Mechanical states that can be an output; see ``State``."""

STATES = 13
"""Length of the state array: ``State``, then the lagged torque [Nm] and the filtered reading [rad/s]."""

LAGGED, FILTERED = 11, 12


class State(NamedTuple):
    """Mechanical state.

    Attributes
    ----------
    angle, speed : float
        Of the motor [rad, rad/s].
    twist : float
        Of the (first) shaft [rad].
    load_speed : float
        Of the load, or of the wheels where the tyre slips [rad/s].
    loading : float
        Of the shaft's slider, from -1 to 1.
    vehicle_speed, traction : float
        Of the vehicle behind the tyre [rad/s], and the torque of a tyre that has to roll to build it up [Nm].
    branch_twist, branch_speed : float
        Of the extra mode [rad, rad/s].
    middle_twist, middle_speed : float
        Twist of the second shaft [rad] and speed of the mass before it [rad/s].
    """

    angle: float
    speed: float
    twist: float
    load_speed: float
    loading: float
    vehicle_speed: float
    branch_twist: float
    branch_speed: float
    middle_twist: float
    middle_speed: float
    traction: float


class Conditions(NamedTuple):
    """What holds during one sub-step: torques [Nm], inertias, stiffness, friction, widths of a sign change [rad/s].

    And what the step can follow: the fastest decay [1/s] and, given the friction inside the shaft, the shortest twist
    over which it yields [rad].
    """

    torque: float
    load: float
    torque_factor: float
    shaft_extra: float
    shaft_factor: float
    joint_angle: float
    joint_rate: float
    inertia_motor: float
    inertia_load: float
    stiffness: float
    viscous_load: float
    dry_load: float
    width_motor: float
    width_load: float
    fastest: float
    yield_twist: float


J_M, J_L, K, C, B_M, B_L = (slot("", name) for name in ("J_M", "J_L", "k", "c", "b_M", "b_L"))
J_2, K_2, C_2 = (slot("", name) for name in ("J_2", "k_2", "c_2"))
LAG = slot("actuator_lag", "time_constant_s")
DELAY = slot("transport_delay", "delay_s")
DELAYED_BEFORE = slot("transport_delay", "before_nm")
LAGGED_BEFORE = slot("actuator_lag", "before_nm")
DRIFT = slot("clock_drift", "rate")
RIPPLE = slot("torque_ripple", "amplitude_nm")
RIPPLE_SHARE = slot("torque_ripple", "share")
RIPPLE_SHARE_PHASE = slot("torque_ripple", "share_phase_rad")
RIPPLE_ORDER = slot("torque_ripple", "order")
RIPPLE_PHASE = slot("torque_ripple", "phase_rad")
COULOMB = slot("coulomb_friction_motor", "friction_nm")
STRIBECK = slot("stribeck_friction", "excess_nm")
STRIBECK_COULOMB = slot("stribeck_friction", "coulomb_nm")
STRIBECK_SPEED = slot("stribeck_friction", "stribeck_rad_s")
QUADRATIC = slot("quadratic_friction", "quadratic_nm_s2")
GENERATOR = slot("generator_coupled", "inertia_kg_m2")
GENERATOR_FROM = slot("generator_coupled", "from_s")
GENERATOR_TO = slot("generator_coupled", "to_s")
GAP = slot("backlash", "gap_rad")
CONTACT = slot("backlash", "contact_rad")
HARDENING = slot("stiffness_nonlinearity", "hardening_per_rad2")
SHAPE = slot("stiffness_nonlinearity", "shape")
CRACK = slot("stiffness_change", "change")
CRACK_FROM = slot("stiffness_change", "from_s")
CRACK_TO = slot("stiffness_change", "to_s")
SLIDER = slot("shaft_hysteresis", "friction_nm")
YIELD = slot("shaft_hysteresis", "yield_rad")
SHARPNESS = slot("shaft_hysteresis", "sharpness")
UNLOADING = slot("shaft_hysteresis", "unloading")
SLIDER_INSIDE = slot("shaft_hysteresis", "inside")
CARDAN = slot("cardan_second_order", "amplitude_nm")
CARDAN_PHASE = slot("cardan_second_order", "phase_rad")
CARDAN_ANGLE = slot("cardan_second_order", "angle_rad")
CARDAN_ANGLE_PHASE = slot("cardan_second_order", "angle_phase_rad")
CARDAN_SHARE = slot("cardan_second_order", "share")
CARDAN_SHARE_PHASE = slot("cardan_second_order", "share_phase_rad")
BRANCH_INERTIA = slot("extra_torsional_mode", "inertia_kg_m2")
BRANCH_FREQUENCY = slot("extra_torsional_mode", "frequency_hz")
LINE_SHARE = slot("extra_torsional_mode", "line_share")
BRANCH_DAMPING = slot("extra_torsional_mode", "damping_ratio")
COULOMB_LOAD = slot("coulomb_friction_load", "friction_nm")
AERO = slot("aerodynamic_drag", "drag_nm_s2")
BRAKE = slot("brake_drag", "brake_nm")
BRAKE_FROM = slot("brake_drag", "from_s")
BRAKE_TO = slot("brake_drag", "to_s")
SLIP = slot("tyre_slip", "slip_per_nm")
SLIP_WHEEL = slot("tyre_slip", "wheel_share")
SLIP_SPEED = slot("tyre_slip", "creep_rad_s")
RELAXATION = slot("tyre_slip", "relaxation_rad")
CARCASS = slot("tyre_slip", "carcass_s")
IMBALANCE = slot("load_imbalance", "amplitude_nm")
IMBALANCE_RATIO = slot("load_imbalance", "motor_turns_per_turn")
IMBALANCE_PHASE = slot("load_imbalance", "phase_rad")
PAYLOAD = slot("inertia_change", "change_kg_m2")
PAYLOAD_FROM = slot("inertia_change", "from_s")
PAYLOAD_TO = slot("inertia_change", "to_s")
WARMING = slot("warming_friction", "cold_nm_s")
WARMING_TIME = slot("warming_friction", "time_constant_s")
RESOLVER_ONCE = slot("resolver_error", "once_rad")
RESOLVER_TWICE = slot("resolver_error", "twice_rad")
RESOLVER_ONCE_PHASE = slot("resolver_error", "once_phase_rad")
RESOLVER_TWICE_PHASE = slot("resolver_error", "twice_phase_rad")
FILTER = slot("speed_filter", "time_constant_s")
FILTERED_BEFORE = slot("speed_filter", "before_rad_s")
BLIND = slot("speed_sign_blind", "share")
QUANTISATION = slot("speed_quantisation", "step_rad_s")

STICK_STABILITY = 1.5
"""Runge-Kutta is stable to h * slope / J = 2.78; friction's slope at standstill is held to about half of it."""


RADIANS_PER_STEP_OF_MODE = 0.6
"""The same for the extra mode, which is seen through the motor's inertia only."""


@inlined
def is_varying(p: FloatArray) -> bool:
    """Tell whether the conditions change within a period: an event, a law over time or over the angle."""
    events = p[GENERATOR] != 0.0 or p[CRACK] != 0.0 or p[PAYLOAD] != 0.0 or p[BRAKE] != 0.0
    ripples = p[RIPPLE] != 0.0 or p[RIPPLE_SHARE] != 0.0 or p[IMBALANCE] != 0.0
    joints = p[CARDAN] != 0.0 or p[CARDAN_ANGLE] != 0.0 or p[CARDAN_SHARE] != 0.0
    return bool(events or ripples or joints or p[WARMING] != 0.0)


@inlined
def motor_friction(speed: float, p: FloatArray, width: float) -> float:
    """Return the torque of every friction law at the motor [Nm], viscous included."""
    return (
        float(p[B_M]) * speed
        + dry_friction(speed, p[COULOMB], width)
        + stribeck_friction.law(speed, p[STRIBECK], p[STRIBECK_COULOMB], p[STRIBECK_SPEED], width)
        + float(p[QUADRATIC]) * speed * abs(speed)
    )


@inlined
def shaft_torque(twist: float, rate: float, loading: float, p: FloatArray, stiffness: float) -> float:
    """Return the torque the shaft carries [Nm] at a twist [rad], its rate [rad/s] and the hysteresis' loading [-]."""
    damping = float(p[C] * p[LINE_SHARE] ** 2) * rate
    loaded = twist
    if p[GAP] > 0.0:
        loaded = beyond_gap(twist, p[GAP])
        damping *= backlash.damping_share(loaded, p[CONTACT])
    if p[SLIDER_INSIDE] > 0.0:
        stiffness = max(stiffness - p[SLIDER_INSIDE] * p[SLIDER] / p[YIELD], 0.0)
    elastic = stiffness * loaded * stiffness_nonlinearity.factor(loaded, p[HARDENING], p[SHAPE])
    return float(elastic) + damping + float(p[SLIDER]) * loading


@inlined
def rates(masses: int, now: Conditions, x: State, p: FloatArray) -> State:
    """Return the time derivative of the mechanical state under the conditions ``now``."""
    drive = now.torque - motor_friction(x.speed, p, now.width_motor)
    branch_acceleration = branch_rate(x.branch_twist, x.speed - x.branch_speed, p)
    drive -= float(p[BRANCH_INERTIA]) * branch_acceleration
    if masses == 1:
        drag = load_drag(x.speed, x.speed, now, p) + now.load
        acceleration = (drive - drag) / now.inertia_motor
        return State(
            x.speed, acceleration, 0.0, 0.0, 0.0, 0.0, x.speed - x.branch_speed, branch_acceleration, 0.0, 0.0, 0.0
        )
    rate = x.speed - (x.middle_speed if masses == 3 else x.load_speed)
    joint_rate = now.joint_rate * x.speed
    shaft = shaft_torque(x.twist + now.joint_angle, rate + joint_rate, x.loading, p, now.stiffness)
    shaft = shaft * now.shaft_factor + now.shaft_extra
    pull = shaft
    reaction = shaft * (1.0 + now.joint_rate)  # a joint that turns unevenly passes on power, not torque
    middle_twist, middle_speed = 0.0, 0.0
    if masses == 3:
        middle_twist = x.middle_speed - x.load_speed
        pull = float(p[K_2]) * x.middle_twist + float(p[C_2]) * middle_twist
        middle_speed = (shaft - pull) / p[J_2]
    load, vehicle, traction = load_rates(pull, now, x, p)
    return State(
        x.speed,
        (drive - reaction) / now.inertia_motor,
        rate,
        load,
        sliding(x.loading, rate, now, p),
        vehicle,
        x.speed - x.branch_speed,
        branch_acceleration,
        middle_twist,
        middle_speed,
        traction,
    )


@inlined
def sliding(loading: float, rate: float, now: Conditions, p: FloatArray) -> float:
    """Return how fast the slider inside the shaft loads [1/s]; 0 where there is none."""
    if p[SLIDER] == 0.0:
        return 0.0
    return shaft_hysteresis.loading_rate(loading, rate, now.yield_twist, p[SHARPNESS], p[UNLOADING], now.fastest)


@inlined
def branch_rate(twist: float, rate: float, p: FloatArray) -> float:
    """Return the acceleration of the extra mode's inertia on its spring [rad/s^2]; 0 where there is none."""
    if p[BRANCH_INERTIA] <= 0.0:
        return 0.0
    frequency = 2.0 * math.pi * float(p[BRANCH_FREQUENCY])
    return frequency * (frequency * twist + 2.0 * float(p[BRANCH_DAMPING]) * rate)


@inlined
def load_drag(wheel: float, vehicle: float, now: Conditions, p: FloatArray) -> float:
    """Return what slows the load down [Nm]: dry friction at the wheel, viscous and air drag at the vehicle."""
    dry = dry_friction(wheel, now.dry_load, now.width_load)
    return dry + now.viscous_load * vehicle + aerodynamic_drag.law(vehicle, p[AERO])


@inlined
def load_rates(pull: float, now: Conditions, x: State, p: FloatArray) -> tuple[float, float, float]:
    """Return the accelerations of the load and, where the tyre slips, of the vehicle [rad/s^2]; the traction's rate."""
    wheel = x.load_speed
    if p[SLIP] <= 0.0:
        return (pull - load_drag(wheel, wheel, now, p) - now.load) / now.inertia_load, 0.0, 0.0
    vehicle = x.vehicle_speed
    share, rate = float(p[SLIP_WHEEL]), 0.0
    if p[RELAXATION] > 0.0:
        traction = x.traction
        wheel_inertia = share * now.inertia_load
        rate = tyre_slip.build_up(
            wheel - vehicle, abs(vehicle), traction, p[SLIP], p[RELAXATION], wheel_inertia, now.fastest
        )
        traction += tyre_slip.carcass(
            wheel - vehicle, vehicle, p[SLIP], p[SLIP_SPEED], p[RELAXATION], p[CARCASS], wheel_inertia * now.fastest
        )
    else:
        steepest = now.fastest * now.inertia_load
        slope, share = tyre_slip.coupling(vehicle, p[SLIP], p[SLIP_SPEED], share, steepest)
        traction = slope * (wheel - vehicle)
    dry = dry_friction(wheel, now.dry_load, now.width_load)
    drag = load_drag(wheel, vehicle, now, p) - dry
    wheel_rate = (pull - dry - traction) / (share * now.inertia_load)
    return wheel_rate, (traction - drag - now.load) / ((1.0 - share) * now.inertia_load), rate


@inlined
def conditions(
    masses: int, time_s: float, h: float, angle: float, load: float, sign_width: float, p: FloatArray
) -> Conditions:
    """Return what holds during the sub-step of length ``h`` [s] from ``time_s`` on, at a motor angle [rad]."""
    coupled = share_inside(time_s, h, p[GENERATOR_FROM], p[GENERATOR_TO])
    cracked = share_inside(time_s, h, p[CRACK_FROM], p[CRACK_TO])
    loaded = share_inside(time_s, h, p[PAYLOAD_FROM], p[PAYLOAD_TO])
    braked = share_inside(time_s, h, p[BRAKE_FROM], p[BRAKE_TO])
    ripple = wave(p[RIPPLE], p[RIPPLE_ORDER] * angle, p[RIPPLE_PHASE])
    torque_factor = 1.0 + wave(p[RIPPLE_SHARE], p[RIPPLE_ORDER] * angle, p[RIPPLE_SHARE_PHASE])
    load += wave(p[IMBALANCE], angle / p[IMBALANCE_RATIO], p[IMBALANCE_PHASE])
    cardan = wave(p[CARDAN], 2.0 * angle, p[CARDAN_PHASE])
    shaft_factor = 1.0 + wave(p[CARDAN_SHARE], 2.0 * angle, p[CARDAN_SHARE_PHASE])
    joint_angle = wave(p[CARDAN_ANGLE], 2.0 * angle, p[CARDAN_ANGLE_PHASE])
    joint_rate = 2.0 * wave(p[CARDAN_ANGLE], 2.0 * angle, p[CARDAN_ANGLE_PHASE] + 0.5 * math.pi)
    inertia_motor = inertia_while(p[J_M], p[GENERATOR], coupled)
    inertia_load = inertia_while(p[J_L], p[PAYLOAD], loaded) if masses > 1 else 0.0
    if masses == 1:
        inertia_motor = inertia_while(inertia_motor, p[PAYLOAD], loaded)
    dry_motor = p[COULOMB] + p[STRIBECK] + p[STRIBECK_COULOMB]
    dry_load = p[COULOMB_LOAD] + braked * p[BRAKE]
    carried = inertia_motor if masses == 1 else (p[SLIP_WHEEL] * inertia_load if p[SLIP] > 0.0 else inertia_load)
    fastest = STICK_STABILITY / h
    lightest = min(inertia_motor, p[J_2] if masses == 3 else carried)
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
        p[K] * p[LINE_SHARE] * (1.0 + cracked * p[CRACK]),
        p[B_L] + warming_friction.cold_part(time_s, p[WARMING], p[WARMING_TIME]),
        dry_load,
        max(sign_width, dry_motor / (fastest * inertia_motor)),
        max(sign_width, dry_load / (fastest * carried)),
        fastest,
        max(p[YIELD], p[SLIDER] / (fastest * fastest * lightest)),
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


@inlined
def moved(x: State, dx: State, h: float) -> State:
    """Return a state moved along its derivative for a time [s]."""
    return State(
        x.angle + h * dx.angle,
        x.speed + h * dx.speed,
        x.twist + h * dx.twist,
        x.load_speed + h * dx.load_speed,
        x.loading + h * dx.loading,
        x.vehicle_speed + h * dx.vehicle_speed,
        x.branch_twist + h * dx.branch_twist,
        x.branch_speed + h * dx.branch_speed,
        x.middle_twist + h * dx.middle_twist,
        x.middle_speed + h * dx.middle_speed,
        x.traction + h * dx.traction,
    )


@inlined
def runge_kutta(masses: int, now: Conditions, torque: float, rise: float, x: State, p: FloatArray, h: float) -> State:
    """Return the state after one sub-step under constant conditions and a torque of this mean and rise [Nm]."""
    begin = with_torque(now, torque - 0.5 * rise)
    middle = with_torque(now, torque)
    end = with_torque(now, torque + 0.5 * rise)
    first = rates(masses, begin, x, p)
    second = rates(masses, middle, moved(x, first, 0.5 * h), p)
    third = rates(masses, middle, moved(x, second, 0.5 * h), p)
    fourth = rates(masses, end, moved(x, third, h), p)
    x = moved(x, first, h / 6.0)
    x = moved(x, second, h / 3.0)
    x = moved(x, third, h / 3.0)
    return moved(x, fourth, h / 6.0)


@inlined
def entry(x: State, output: int) -> float:
    """Return the state that is an output: ANGLE, SPEED, TWIST or LOAD_SPEED."""
    if output == SPEED:
        return x.speed
    if output == LOAD_SPEED:
        return x.load_speed
    return x.twist if output == TWIST else x.angle


@inlined
def travelled(x: State, output: int) -> float:
    """Return the angle whose rate is the output [rad]: what a filter's input has been in the mean is its change."""
    return x.angle if output == SPEED else x.angle - x.twist - x.middle_twist


@inlined
def reading(speed: float, angle: float, p: FloatArray) -> float:
    """Return the speed that the resolver gives [rad/s] at a motor angle [rad]."""
    return speed * resolver_error.slope(
        angle, p[RESOLVER_ONCE], p[RESOLVER_ONCE_PHASE], p[RESOLVER_TWICE], p[RESOLVER_TWICE_PHASE]
    )


@inlined
def shown(read: float, filtered: float, p: FloatArray) -> float:
    """Return what is recorded of a reading: filtered, without its sign, quantised, as the sensor has it [rad/s]."""
    value = filtered if p[FILTER] > 0.0 else read
    value += float(p[BLIND]) * (abs(value) - value)
    step = float(p[QUANTISATION])
    return step * math.floor(value / step + 0.5) if step > 0.0 else value


@inlined
def unpacked(state: FloatArray) -> State:
    """Return the mechanical part of the state array."""
    return State(
        state[0], state[1], state[2], state[3], state[4], state[5], state[6], state[7], state[8], state[9], state[10]
    )


@inlined
def integrate_masses(
    masses: int,
    sample_time_s: float,
    substeps: int,
    sign_width: float,
    first: int,
    start_s: float,
    torque: FloatArray,
    load: FloatArray,
    angle: FloatArray,
    p: FloatArray,
    state: FloatArray,
    output: int,
    sensor: bool,
    out: FloatArray,
    slopes: FloatArray,
) -> None:
    """Do what ``integrate`` does, for a number of masses that is known when it is compiled."""
    if p[BRANCH_INERTIA] > 0.0:
        turn_of_mode = 2.0 * math.pi * p[BRANCH_FREQUENCY] * sample_time_s
        substeps = max(substeps, math.ceil(turn_of_mode / RADIANS_PER_STEP_OF_MODE))
    h = sample_time_s / substeps
    length = 1.0 / substeps
    delay, begun = p[DELAY] / sample_time_s, start_s / sample_time_s
    before_all = torque[0] + p[DELAYED_BEFORE]
    varying, filtering = is_varying(p), p[FILTER] > 0.0
    late = p[DELAY] != 0.0 or p[DRIFT] != 0.0
    steep = slopes.shape[1] > 0
    slope = 0.0
    n = torque.shape[0]
    x = unpacked(state)
    lagged, filtered = state[LAGGED], state[FILTERED]
    now = conditions(masses, start_s, h, 0.0, 0.0, sign_width, p)
    for k in range(first, n):
        turn = angle[k + 1] - angle[k] if k + 1 < n else angle[k] - angle[k - 1]
        value = entry(x, output)
        out[k] = shown(reading(value, angle[k], p), filtered, p) if sensor else value
        if steep:
            slopes[0, k] = slope
        for j in range(substeps):
            place = k + j * length
            if varying or j == 0:
                middle = angle[k] + turn * (j + 0.5) * length
                now = conditions(masses, start_s + place * sample_time_s, h, middle, load[k], sign_width, p)
            supplied, rise = torque[k], 0.0
            if late:
                source = place + (place + begun) * p[DRIFT] - delay
                supplied, rise = transport_delay.delayed(torque, before_all, source, length)
            mean, rise, lagged = actuator_lag.step(supplied, rise, lagged, p[LAG], h)
            before, begun_at = entry(x, output), x
            x = runge_kutta(masses, now, mean, rise, x, p, h)
            after = entry(x, output)
            slope = (after - before) / h
            if filtering:
                bow = travelled(x, output) / h - travelled(begun_at, output) / h - 0.5 * (before + after)
                read = reading(before + bow, angle[k] + turn * j * length, p)
                ends = reading(after + bow, angle[k] + turn * (j + 1) * length, p)
                filtered = speed_filter.step(read, ends, filtered, p[FILTER], h)
            if steep and j == 0:
                slopes[1, k] = slope
    for i, last in enumerate(x):
        state[i] = last
    state[LAGGED], state[FILTERED] = lagged, filtered


@compiled
def integrate(
    masses: int,
    sample_time_s: float,
    substeps: int,
    sign_width: float,
    first: int,
    start_s: float,
    torque: FloatArray,
    load: FloatArray,
    angle: FloatArray,
    p: FloatArray,
    state: FloatArray,
    output: int,
    sensor: bool,
    out: FloatArray,
    slopes: FloatArray,
) -> None:
    """Simulate samples ``first`` to the end of ``torque``; row k of ``out`` is the state entry before torque k acts.

    Parameters
    ----------
    masses : int
        1, 2 or 3.
    sample_time_s : float
        Sampling period [s].
    substeps : int
        Integration steps per period.
    sign_width : float
        Speed within which dry friction changes sign [rad/s].
    first : int
        Sample to start at; earlier torques are only seen through the delay.
    start_s : float
        Time of sample 0, for laws over time [s].
    torque, load : ndarray, shape (N,)
        Torque on the motor shaft before delay and lag, held over each period, and load torque [Nm].
    angle : ndarray, shape (N,)
        Motor angle at each sample, which periodic laws take their phase from [rad].
    p : ndarray, shape (layout.SIZE,)
        Parameters of the superset model.
    state : ndarray, shape (STATES,)
        Start state; the end state afterwards.
    output : int
        Which state is the output.
    sensor : bool
        Whether the output is seen through the speed sensor.
    out : ndarray, shape (N,)
        Filled from ``first`` on.
    slopes : ndarray, shape (2, N) or (2, 0)
        Where it has room: slope of the output just before and just after each sample [unit of the output / s].
    """
    given = (sample_time_s, substeps, sign_width, first, start_s, torque, load, angle, p)
    wanted = (state, output, sensor, out, slopes)
    if masses == 1:
        integrate_masses(1, *given, *wanted)
    elif masses == 2:
        integrate_masses(2, *given, *wanted)
    else:
        integrate_masses(3, *given, *wanted)


@brief
def integrate_period(*given: Any) -> None:
    """Do what ``integrate`` does, with its arguments, for a rig that is stepped period by period."""
    integrate(*given)


@compiled
def integrate_each(
    masses: int,
    sample_time_s: float,
    substeps: int,
    sign_width: float,
    start_s: float,
    torque: FloatArray,
    load: FloatArray,
    angle: FloatArray,
    p: FloatArray,
    state: FloatArray,
    output: int,
    sensor: bool,
    out: FloatArray,
    slopes: FloatArray,
) -> None:
    """Do what ``integrate`` does for every row of ``torque``, ``load``, ``p``, ``state``, ``out`` and ``slopes``.

    One call for many simulations: threads do not wait for the interpreter in between.
    """
    given = (sample_time_s, substeps, sign_width, 0, start_s)
    for i in range(torque.shape[0]):
        rows = (torque[i], load[i], angle, p[i], state[i])
        integrate(masses, *given, *rows, output, sensor, out[i], slopes[i])
