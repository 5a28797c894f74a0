"""What is taken down of a state: the speed as the resolver gives it, and what hill and brake do to the load."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.compiled import compiled
from hil.proof.truth.laws_in_angle import gravity_torque, resolver_speed
from hil.proof.truth.laws_in_time import brake_torque
from hil.proof.truth.physics import FloatArray, Physics
from hil.proof.truth.state import State


@compiled
def speed_as_sensed(p: Physics, state: FloatArray) -> float:
    """Return the motor speed as the resolver gives it, behind its filter where it has one [rad/s]."""
    if p.filter_time_s > 0.0 or p.filter_rad_s > 0.0:
        return float(state[State.FILTERED])
    return float(resolver_speed(p, state[State.ANGLE_M], state[State.SPEED_M]))


@compiled
def observed(p: Physics, states: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return speeds [rad/s] and torques against the load beyond the constant one [Nm] of states, shape (N, STATES)."""
    speed, disturbance = np.empty(states.shape[0]), np.empty(states.shape[0])
    for i in range(states.shape[0]):
        speed[i] = speed_as_sensed(p, states[i])
        disturbance[i] = gravity_torque(p, states[i, State.ANGLE_L]) + brake_torque(p, states[i, State.TIME_S])
    return speed, disturbance
