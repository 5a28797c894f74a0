r"""A bus with nothing hidden in it, as the truth simulator drives it, one period at a time.

Such a line is linear and its torque is constant over a period, so that one period is

    x[n+1] = A x[n] + b T[n] + l,    x = (twist, motor speed, load speed),

whatever the integrator makes of the period. A, b and l are read off the integrator itself, from periods that begin at
unit states: they agree with it to rounding, and a recording costs 3000 products of 3 x 3 instead of 300000 steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from hil.proof.truth import kernel
from hil.proof.truth.bus import Bus
from hil.proof.truth.compiled import compiled
from hil.proof.truth.experiments import PERIOD_S
from hil.proof.truth.physics import FloatArray, Physics
from hil.proof.truth.state import STATES, State

PARAMETERS = ("J_M", "J_L", "k", "c", "b_M", "b_L")
"""What the nominal model has values for."""


@dataclass(frozen=True, slots=True)
class Line:
    """One period of a bus with nothing hidden.

    Attributes
    ----------
    transition : ndarray, shape (3, 3)
        A: what a twist [rad], a motor speed and a load speed [rad/s] become.
    by_torque : ndarray, shape (3,)
        b: what 1 Nm of the inverters moves.
    by_load : ndarray, shape (3,)
        What 1 Nm against the load moves.
    """

    transition: FloatArray
    by_torque: FloatArray
    by_load: FloatArray

    def speed_rad_s(self, torque_nm: FloatArray, load_nm: float, start: FloatArray) -> FloatArray:
        """Return the motor's speed every period, before the period's torque acts, shape (N,).

        Parameters
        ----------
        torque_nm
            Of both inverters together, one value a period, shape (N,).
        load_nm
            Constant torque against the load.
        start
            Twist [rad], motor and load speed [rad/s] at the beginning, shape (3,).
        """
        return _speeds(self.transition, self.by_torque, self.by_load * load_nm, torque_nm, start)

    def of_load_and_start(self, samples: int) -> list[FloatArray]:
        """Return what a load torque of 1 Nm moves, and each unit of the initial state; shape (samples,) each.

        The line is linear in all four, which each recording has for itself.
        """
        silence = np.zeros(samples)
        by_load = self.speed_rad_s(silence, 1.0, np.zeros(3))
        return [by_load, *(self.speed_rad_s(silence, 0.0, start) for start in np.eye(3))]


@compiled
def _speeds(
    transition: FloatArray, by_torque: FloatArray, each_period: FloatArray, torque_nm: FloatArray, start: FloatArray
) -> FloatArray:
    speeds = np.empty(torque_nm.size)
    twist, motor, load = start[0], start[1], start[2]
    for row in range(torque_nm.size):
        speeds[row] = motor
        t = torque_nm[row]
        after = (
            transition[0, 0] * twist + transition[0, 1] * motor + transition[0, 2] * load + by_torque[0] * t,
            transition[1, 0] * twist + transition[1, 1] * motor + transition[1, 2] * load + by_torque[1] * t,
            transition[2, 0] * twist + transition[2, 1] * motor + transition[2, 2] * load + by_torque[2] * t,
        )
        twist, motor, load = after[0] + each_period[0], after[1] + each_period[1], after[2] + each_period[2]
    return speeds


def line_of(bus: Bus) -> Line:
    """Return one period of a bus; a bus itself hides nothing."""
    free = replace(bus, load_torque_nm=0.0).physics()
    loaded = replace(bus, load_torque_nm=1.0).physics()
    return Line(
        transition=np.column_stack([_after(free, unit, 0.0) for unit in np.eye(3)]),
        by_torque=_after(free, np.zeros(3), 1.0),
        by_load=_after(loaded, np.zeros(3), 0.0),
    )


def _after(physics: Physics, start: FloatArray, torque_nm: float) -> FloatArray:
    state = np.zeros(STATES)
    state[[State.ANGLE_M, State.SPEED_M, State.SPEED_L]] = start
    kernel.advance(state, physics, torque_nm, PERIOD_S)
    return np.array([state[State.ANGLE_M] - state[State.ANGLE_L], state[State.SPEED_M], state[State.SPEED_L]])


def scaled(bus: Bus, shares: Mapping[str, float]) -> Bus:
    """Return a bus some of whose `PARAMETERS` are multiplied."""
    return replace(bus, **{name: getattr(bus, name) * share for name, share in shares.items()})
