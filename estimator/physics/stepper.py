"""The superset model one period at a time: the driveline behind a simulated rig."""

from __future__ import annotations

import numpy as np

from estimator.errors import BadModel
from estimator.physics.driveline import Start
from estimator.physics.effects.timing import TRANSPORT_DELAY
from estimator.physics.grid import substeps_for
from estimator.physics.inputs import initial_state, shaft_torque_from
from estimator.physics.kernel import integration, sensing, state_vector
from estimator.physics.layout import flat, slot
from estimator.physics.model import DrivelineModel
from estimator.physics.simulate import MASSES

SIGN_WIDTH_RAD_S = 0.02
"""Dry friction of a simulated rig changes sign within this speed; its noise is larger."""

FINER = 2
"""A rig is stepped once and not thousands of times as in a fit: finer steps let friction stick closer to standstill."""


class Stepper:
    """Advances a driveline by one period of constant torque at a time."""

    def __init__(
        self, model: DrivelineModel, period_s: float, load_torque_nm: float = 0.0, speed_rad_s: float = 0.0
    ) -> None:
        self._masses = MASSES[model.structure]
        self._p = flat(model)
        if laws := [law for law in model.laws if law.is_active(self._p)]:
            raise BadModel(
                f"effects.{laws[0]}: expected effects of the catalogue, got a law of your own, which a simulated "
                "rig can't have. Take it out of the model file."
            )
        self._period_s = period_s
        self._substeps = FINER * substeps_for(model.values(), period_s)
        history = int(np.ceil(self._p[slot(TRANSPORT_DELAY.name, "delay_s")] / period_s)) + 2
        self._steps = 0
        self._warmth = 0.0
        self._torque = np.zeros(history)
        self._load = np.full(history, load_torque_nm)
        self._angle = np.zeros(history)
        self._outputs, self._out = np.array([state_vector.SPEED]), np.zeros((1, history))
        self._slopes = np.zeros((2, 0))
        start = Start(load_torque_nm, 0.0, speed_rad_s, load_speed_rad_s=speed_rad_s, middle_speed_rad_s=speed_rad_s)
        self._state = initial_state(start, 0.0, 0.0, self._p)

    @property
    def speed_rad_s(self) -> float:
        """Motor speed now, as the sensor shows it [rad/s]."""
        state = self._state
        read = sensing.reading(state[state_vector.SPEED], self._read_angle(), self._p)
        return float(sensing.shown(read, state[state_vector.FILTERED], self._p))

    @property
    def angle_rad(self) -> float:
        """Motor angle now [rad]."""
        return float(self._state[state_vector.ANGLE])

    def step(self, *torque_nm: float) -> None:
        """Let the torque of each input [Nm] act for one period."""
        now = np.array([self._steps * self._period_s])
        self._torque[:-1] = self._torque[1:]
        on_shaft, self._warmth = shaft_torque_from(np.array([torque_nm]), now, self._period_s, self._p, self._warmth)
        self._torque[-1] = on_shaft[0]
        self._angle[-1] = self._read_angle()
        self._angle[-2] = self._angle[-1] - self._state[state_vector.SPEED] * self._period_s  # it goes straight on
        last = self._torque.size - 1
        integration.integrate_period(
            self._masses,
            (),
            self._period_s,
            self._substeps,
            SIGN_WIDTH_RAD_S,
            last,
            last + 1,
            (self._steps - last) * self._period_s,
            self._torque,
            self._load,
            self._angle,
            self._p,
            self._state,
            self._outputs,
            False,
            self._out,
            self._slopes,
        )
        self._steps += 1

    def _read_angle(self) -> float:
        """Return the motor angle that the resolver gives now [rad]: laws that are periodic in it know no other."""
        return float(sensing.read_angle(self._state[state_vector.ANGLE], self._p))
