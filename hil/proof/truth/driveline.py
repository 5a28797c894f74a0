"""The driveline as a plant: feed it two torques for a time, read its resolver."""

from __future__ import annotations

import numpy as np

from hil.proof.truth import kernel
from hil.proof.truth.delay_line import DelayLine
from hil.proof.truth.inverters import true_torque, true_torques
from hil.proof.truth.observed import speed_as_sensed
from hil.proof.truth.physics import FloatArray, Physics
from hil.proof.truth.state import SPEEDS, STATES, State


class TruthDriveline:
    """A driveline with all it hides; has the shape of ``hil.simulator.plant.Plant``.

    Parameters
    ----------
    physics
        The driveline.
    speed_rad_s
        Speed it is rolling at when it starts, shaft unloaded.
    """

    def __init__(self, physics: Physics, speed_rad_s: float = 0.0) -> None:
        self._physics = physics
        self._delay = DelayLine(physics.delay_s)
        self._state = np.zeros(STATES)
        self._state[list(SPEEDS)] = speed_rad_s

    def advance(self, torque_nm: tuple[float, float], duration_s: float) -> None:
        """Hold both inverters' torque [Nm] for a time [s]."""
        total_nm = true_torque(self._physics, torque_nm, float(self._state[State.TIME_S]))
        for piece in self._delay.push(total_nm, duration_s):
            kernel.advance(self._state, self._physics, piece.torque_nm, piece.duration_s)

    def course(self, m1_nm: FloatArray, m2_nm: FloatArray, durations_s: FloatArray) -> FloatArray:
        """Hold torques for their times, shapes (N,), one after the other; return the states after each, (N, STATES)."""
        begins_s = self._state[State.TIME_S] + np.cumsum(durations_s) - durations_s
        pieces = [
            self._delay.push(total_nm, duration_s)
            for total_nm, duration_s in zip(
                true_torques(self._physics, m1_nm, m2_nm, begins_s).tolist(), durations_s.tolist(), strict=True
            )
        ]
        ends = np.cumsum([len(each) for each in pieces]) - 1
        commands_nm = np.array([piece.torque_nm for each in pieces for piece in each])
        held_s = np.array([piece.duration_s for each in pieces for piece in each])
        states: FloatArray = kernel.course(self._state, self._physics, commands_nm, held_s)[ends]
        return states

    def continue_with(self, physics: Physics) -> None:
        """Change the physics under way: motion and twist continue, clock and distance start again at zero."""
        self._physics = physics
        self._state[[State.ANGLE_M, State.ANGLE_X]] -= self._state[State.ANGLE_L]
        self._state[[State.TIME_S, State.ANGLE_L]] = 0.0

    def quantity(self, which: State) -> float:
        """Return one of the true quantities, which no sensor shows."""
        return float(self._state[which])

    @property
    def state(self) -> FloatArray:
        """Copy of the true state, shape (STATES,), in the order of `State`."""
        return self._state.copy()

    @property
    def physics(self) -> Physics:
        """The driveline's physics."""
        return self._physics

    @property
    def speed_rad_s(self) -> float:
        """Motor speed as the resolver gives it, behind its filter where it has one [rad/s]."""
        return float(speed_as_sensed(self._physics, self._state))
