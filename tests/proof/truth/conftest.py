"""A bus with round numbers, and what several tests do with a driveline."""

import numpy as np
import pytest

from hil.proof.truth.driveline import TruthDriveline
from hil.proof.truth.physics import Physics, StateIndex


@pytest.fixture
def plain():
    """A linear driveline without a load torque."""
    return Physics(J_M=1.6, J_L=95.0, k=4200.0, c=9.0, b_M=0.35, b_L=0.9)


@pytest.fixture
def lossless(plain):
    """The same without any damping."""
    return plain._replace(c=0.0, b_M=0.0, b_L=0.0)


@pytest.fixture
def trace():
    """Drive and keep the true states, shape (N + 1, 9): row k is the state before sample k."""

    def run(physics, torques_nm, period_s=0.01, speed_rad_s=0.0):
        driveline = TruthDriveline(physics, speed_rad_s)
        states = [driveline.state]
        for torque in torques_nm:
            driveline.advance((0.5 * torque, 0.5 * torque), period_s)
            states.append(driveline.state)
        return np.array(states)

    return run


@pytest.fixture
def twist():
    """Twist of the shaft in each row of a trace [rad]."""

    def of(states):
        return states[:, StateIndex.ANGLE_M] - states[:, StateIndex.ANGLE_L]

    return of
