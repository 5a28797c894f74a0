"""The superset model one period at a time: the driveline behind a simulated rig."""

from __future__ import annotations

import numpy as np

from estimator.physics import kernel
from estimator.physics.effects import transport_delay
from estimator.physics.layout import flat, slot
from estimator.physics.model import DrivelineModel, Structure
from estimator.physics.simulate import substeps_for

SIGN_WIDTH_RAD_S = 0.02
"""Dry friction of a simulated rig changes sign within this speed; its noise is larger."""


class Stepper:
    """Advances a driveline by one period of constant torque at a time.

    Parameters
    ----------
    model : DrivelineModel
        With its effects.
    period_s : float
        Length of a step [s].
    load_torque_nm : float
        Constant load torque [Nm].
    """

    def __init__(self, model: DrivelineModel, period_s: float, load_torque_nm: float = 0.0) -> None:
        self._masses = 1 if model.structure is Structure.ONE_MASS else 2
        self._p = flat(model)
        self._period_s = period_s
        self._substeps = substeps_for(model.values(), period_s)
        history = int(np.ceil(self._p[slot(transport_delay.EFFECT.name, "delay_s")] / period_s)) + 2
        self._torque = np.zeros(history)
        self._load = np.full(history, load_torque_nm)
        self._out = np.zeros(history)
        self._state = np.zeros(kernel.STATES)

    @property
    def speed_rad_s(self) -> float:
        """Motor speed now [rad/s]."""
        return float(self._state[kernel.SPEED])

    @property
    def angle_rad(self) -> float:
        """Motor angle now [rad]."""
        return float(self._state[kernel.ANGLE])

    def step(self, torque_nm: float) -> None:
        """Let a torque [Nm] act for one period."""
        self._torque[:-1] = self._torque[1:]
        self._torque[-1] = torque_nm
        kernel.integrate(
            self._masses,
            self._period_s,
            self._substeps,
            SIGN_WIDTH_RAD_S,
            self._torque.size - 1,
            self._torque,
            self._load,
            self._p,
            self._state,
            kernel.SPEED,
            self._out,
        )
