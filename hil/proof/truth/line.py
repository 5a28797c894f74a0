"""The line from motor to vehicle: which torque acts on each of its inertias.

Motor, shaft and load; next to them, where there is one, an extra inertia before or behind the shaft, and the vehicle
behind a tyre that slips (the load is then the wheels).
"""

from __future__ import annotations

from hil.proof.truth import laws
from hil.proof.truth.compiled import compiled
from hil.proof.truth.physics import STATES, FloatArray, Physics, State

Speeds = tuple[float, float, float, float]
"""Of motor, extra inertia, load (wheels), vehicle [rad/s]; also used for accelerations."""


@compiled
def speeds_of(state: FloatArray) -> Speeds:
    """Return the speeds of a state."""
    return state[State.SPEED_M], state[State.SPEED_X], state[State.SPEED_L], state[State.SPEED_V]


@compiled
def shaft_ends(p: Physics, motor: float, extra: float, load: float) -> tuple[float, float]:
    """Return what the shaft has at its driving and its driven end, of angles or of speeds."""
    if p.extra_inertia <= 0.0:
        return motor, load
    return (extra, load) if p.extra_at_motor else (motor, extra)


@compiled
def shaft_twist(state: FloatArray, p: Physics) -> tuple[float, float]:
    """Return the shaft's twist behind its Cardan joint [rad], and that joint's slope."""
    driving, driven = shaft_ends(p, state[State.ANGLE_M], state[State.ANGLE_X], state[State.ANGLE_L])
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
    hill = laws.gravity_torque(p, state[State.ANGLE_L]) * laws.mass_over_empty(p, state[State.TIME_S])
    disturbance_nm: float = p.load_torque_nm + hill
    return disturbance_nm


@compiled
def _on_motor(state: FloatArray, p: Physics, speed: float) -> float:
    """Torque on the motor inertia without the line's."""
    given = state[State.INVERTER_NM]
    torque: float = given - p.b_M * speed - p.quadratic_motor * speed * abs(speed) - laws.eddy_torque(p, speed)
    torque -= laws.torque_by_direction(p, speed)
    torque += laws.ripple_torque(p, state[State.ANGLE_M], given)
    if p.friction_motor_nm > 0.0:
        limit = breakaway_limit(p, speed)
        torque -= laws.friction_torque(p.friction_motor_nm, limit, state[State.BRISTLE_M], speed)
    return torque


@compiled
def _on_load(state: FloatArray, p: Physics, speed: float) -> float:
    """Torque of wheels, axle, bearings and brake on the load inertia."""
    torque = -p.b_L * laws.viscosity_over_warm(p, state[State.TIME_S]) * speed
    torque -= laws.imbalance_torque(p, state[State.ANGLE_L])
    held = p.friction_load_nm + laws.brake_torque(p, state[State.TIME_S])
    if held > 0.0:
        torque -= laws.friction_torque(held, 1.0, state[State.BRISTLE_L], speed)
    return torque


@compiled
def _through_shaft(state: FloatArray, p: Physics, speeds: Speeds) -> tuple[float, float]:
    """Torque at the shaft's driving and at its driven end."""
    motor, extra, load, _ = speeds
    twist, slope = shaft_twist(state, p)
    driving, driven = shaft_ends(p, motor, extra, load)
    stiffness = laws.stiffness_over_k(p, state[State.TIME_S], driving)
    slider_nm = laws.slider_torque(state[State.SLIDERS : STATES], p) if p.hysteresis_stiffness > 0.0 else 0.0
    torque: float = laws.shaft_torque(p, twist, slope * driving - driven, stiffness, slider_nm)
    torque += state[State.MAXWELL_NM] + state[State.MAXWELL_FAST_NM]
    return slope * torque, laws.behind_gears(p, torque, driven)


@compiled
def _of_wheels_and_vehicle(
    state: FloatArray, p: Physics, wheels_nm: float, vehicle_nm: float, speeds: Speeds
) -> tuple[float, float]:
    """Accelerations of the wheels and of the vehicle, which are one where the tyre can't slip."""
    _, _, wheels, vehicle = speeds
    inertia = p.J_L * laws.mass_over_empty(p, state[State.TIME_S])
    if p.wheel_inertia <= 0.0:
        both = (wheels_nm + vehicle_nm) / inertia
        return both, both
    tyre_nm = laws.tyre_torque(p, state[State.SLIP], wheels, vehicle)
    return (wheels_nm - tyre_nm) / p.wheel_inertia, (tyre_nm + vehicle_nm) / (inertia - p.wheel_inertia)


@compiled
def _through_link(state: FloatArray, p: Physics, speeds: Speeds) -> float:
    """Torque through the spring between the extra inertia and the motor, or the load."""
    motor, extra, load, _ = speeds
    if p.extra_at_motor:
        twist, rate = state[State.ANGLE_M] - state[State.ANGLE_X], motor - extra
    else:
        twist, rate = state[State.ANGLE_X] - state[State.ANGLE_L], extra - load
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
