"""The state in which a simulation starts: what is unknown of it, and what follows from that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.compiled import compiled, inlined
from estimator.physics.kernel import bristles, sensing, slots, state_vector
from estimator.physics.kernel.conditions import branch_frequency, branch_inertia
from estimator.physics.kernel.line import is_bristled, is_within
from estimator.signals.record import FloatArray


@dataclass(frozen=True, slots=True)
class Start:
    """What is unknown in every recording: constant load torque [Nm] and initial state [rad, rad/s].

    Of a joint also the preload behind its gap [Nm].
    """

    load_torque_nm: float
    angle_rad: float
    speed_rad_s: float
    twist_rad: float = 0.0
    load_speed_rad_s: float = 0.0
    middle_twist_rad: float = 0.0
    middle_speed_rad_s: float = 0.0
    preload_nm: float = 0.0


def initial_state(start: Start, torque_nm: float, angle_rad: float, p: FloatArray) -> FloatArray:
    """Return the kernel's state at the start: what is not unknown follows from the rest as if it were steady."""
    only: FloatArray = initial_states([start], np.array([torque_nm]), angle_rad, p[np.newaxis])[0]
    return only


def initial_states(starts: Sequence[Start], torque_nm: FloatArray, angle_rad: float, p: FloatArray) -> FloatArray:
    """Return ``initial_state`` of K simulations with these torques, (K,), and parameters, (K, layout.SIZE)."""
    states = np.zeros((len(starts), state_vector.STATES))
    for row, start in zip(states, starts, strict=True):
        row[state_vector.ANGLE] = start.angle_rad
        row[state_vector.SPEED] = start.speed_rad_s
        row[state_vector.TWIST] = start.twist_rad
        row[state_vector.LOAD_SPEED] = start.load_speed_rad_s
        row[state_vector.MIDDLE_TWIST] = start.middle_twist_rad
        row[state_vector.MIDDLE_SPEED] = start.middle_speed_rad_s
        row[state_vector.TRACTION] = start.load_torque_nm
    _follow(states, torque_nm, angle_rad, p)
    return states


@compiled
def _follow(states: FloatArray, torque_nm: FloatArray, angle_rad: float, p: FloatArray) -> None:
    """Fill in what follows from the rest, a row per simulation."""
    for row in range(states.shape[0]):
        follow(states[row], torque_nm[row], angle_rad, p[row])


@inlined
def follow(x: FloatArray, torque_nm: float, angle_rad: float, p: FloatArray) -> None:
    """Fill in what follows from the rest of a state, shape (STATES,)."""
    speed, carried = x[state_vector.SPEED], x[state_vector.LOAD_SPEED]
    x[state_vector.VEHICLE_SPEED] = carried
    x[state_vector.BRANCH_SPEED] = carried if p[slots.BEHIND] > 0.0 else speed
    if is_within(p):  # another spring of the line carries what the shaft does
        x[state_vector.BRANCH_TWIST] = (
            p[slots.K] * x[state_vector.TWIST] / (branch_inertia(p) * branch_frequency(p) ** 2)
        )
    x[state_vector.LAGGED] = torque_nm + p[slots.LAGGED_BEFORE]
    x[state_vector.LAG_RISE] = -p[slots.LAGGED_BEFORE]
    x[state_vector.FILTERED] = sensing.reading(speed, angle_rad, p) + p[slots.FILTERED_BEFORE]
    x[state_vector.FILTER_RISE] = -p[slots.FILTERED_BEFORE]
    if is_bristled(p):  # of friction that has slid for long
        x[state_vector.BRISTLES_MOTOR] = bristles.slid(speed, bristles.sliding(speed, p))
        loaded = carried if p[slots.J_L] > 0.0 else speed
        x[state_vector.BRISTLES_LOAD] = bristles.slid(loaded, p[slots.COULOMB_LOAD])
