"""Time integration by Strang splitting, second order and symplectic where nothing is lost.

Half a drift (angles, bristles, relaxing torques: each solved exactly at constant speed), a kick (speeds under
the torques at fixed angles, midpoint rule for what depends on speed), half a drift.
"""

from __future__ import annotations

import math
from enum import IntEnum

from hil.proof.truth import laws
from hil.proof.truth.compiled import compiled
from hil.proof.truth.physics import FloatArray, Physics

MAX_STEP_S = 1e-4
"""The shaft mode (51 rad/s) moves by 0.005 rad of phase in it: relative error of its period 1e-6. Against the
closed solution the speed is right to 0.0002 rad/s, against a stiff reference of all laws to 0.002 rad/s: a
twentieth of the sensor's noise."""


class State(IntEnum):
    """Where each quantity stands in the state array."""

    ANGLE_M = 0
    ANGLE_L = 1
    SPEED_M = 2
    SPEED_L = 3
    BRISTLE_M = 4
    BRISTLE_L = 5
    MAXWELL_NM = 6
    INVERTER_NM = 7
    TIME_S = 8


@compiled
def _limit(p: Physics, speed: float) -> float:
    if p.breakaway_motor_nm <= p.friction_motor_nm:
        return 1.0
    sliding = laws.sliding_torque(p.friction_motor_nm, p.breakaway_motor_nm, p.stribeck_speed_rad_s, speed)
    return sliding / p.friction_motor_nm


@compiled
def _drift(state: FloatArray, p: Physics, command_nm: float, h: float) -> None:
    speed_m, speed_l = state[State.SPEED_M], state[State.SPEED_L]
    state[State.ANGLE_M] += speed_m * h
    state[State.ANGLE_L] += speed_l * h
    state[State.TIME_S] += h
    if p.friction_motor_nm > 0.0:
        state[State.BRISTLE_M] = laws.bristle_after(state[State.BRISTLE_M], speed_m, _limit(p, speed_m), h)
    if p.brake_nm > 0.0:
        state[State.BRISTLE_L] = laws.bristle_after(state[State.BRISTLE_L], speed_l, 1.0, h)
    if p.maxwell_stiffness > 0.0:
        steady = p.maxwell_stiffness * p.maxwell_time_s * (speed_m - speed_l)
        state[State.MAXWELL_NM] = steady + (state[State.MAXWELL_NM] - steady) * math.exp(-h / p.maxwell_time_s)
    if p.current_loop_time_s > 0.0:
        error = state[State.INVERTER_NM] - command_nm
        state[State.INVERTER_NM] = command_nm + error * math.exp(-h / p.current_loop_time_s)
    else:
        state[State.INVERTER_NM] = command_nm


@compiled
def _load_disturbance(state: FloatArray, p: Physics) -> float:
    """Torque against the load that depends on place and time alone."""
    disturbance_nm: float = p.load_torque_nm + laws.gravity_torque(p, state[State.ANGLE_L])
    return disturbance_nm


@compiled
def _motor_torque(state: FloatArray, p: Physics, speed: float) -> float:
    """Torque on the motor inertia without the shaft's."""
    torque: float = state[State.INVERTER_NM] - p.b_M * speed - p.quadratic_motor * speed * abs(speed)
    if p.friction_motor_nm > 0.0:
        limit = _limit(p, speed)
        torque -= laws.friction_torque(p.friction_motor_nm, limit, state[State.BRISTLE_M], speed)
    return torque


@compiled
def _load_torque(state: FloatArray, p: Physics, speed: float) -> float:
    """Torque on the load inertia without the shaft's and without the disturbance."""
    torque = -p.b_L * speed - p.quadratic_load * speed * abs(speed)
    if p.brake_nm > 0.0:
        held = laws.brake_torque(p, state[State.TIME_S])
        torque -= laws.friction_torque(held, 1.0, state[State.BRISTLE_L], speed)
    return torque


@compiled
def _accelerations(
    state: FloatArray, p: Physics, disturbance_nm: float, speed_m: float, speed_l: float
) -> tuple[float, float]:
    twist = state[State.ANGLE_M] - state[State.ANGLE_L]
    shaft = laws.shaft_torque(p, twist, speed_m - speed_l) + state[State.MAXWELL_NM]
    motor = _motor_torque(state, p, speed_m) - shaft
    load = _load_torque(state, p, speed_l) + shaft - disturbance_nm
    return motor / p.J_M, load / p.J_L


@compiled
def advance(state: FloatArray, p: Physics, command_nm: float, duration_s: float) -> None:
    """Move the state on by ``duration_s`` under a constant torque command.

    Parameters
    ----------
    state : ndarray, shape (9,)
        In the order of `State`; changed in place.
    p : Physics
        The driveline.
    command_nm : float
        Torque that reaches the current loops, both inverters together [Nm].
    duration_s : float
        Time to go on by [s]; divided into equal steps of at most `MAX_STEP_S`.
    """
    steps = math.ceil(duration_s / MAX_STEP_S - 1e-9)
    if steps < 1:
        return
    h = duration_s / steps
    half = 0.5 * h
    for _ in range(steps):
        _drift(state, p, command_nm, half)
        outer = _load_disturbance(state, p)
        speed_m, speed_l = state[State.SPEED_M], state[State.SPEED_L]
        acc_m, acc_l = _accelerations(state, p, outer, speed_m, speed_l)
        acc_m, acc_l = _accelerations(state, p, outer, speed_m + half * acc_m, speed_l + half * acc_l)
        state[State.SPEED_M] = speed_m + h * acc_m
        state[State.SPEED_L] = speed_l + h * acc_l
        _drift(state, p, command_nm, half)
