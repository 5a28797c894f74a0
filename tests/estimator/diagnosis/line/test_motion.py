"""The motion of a fit against the exact one of a linear line."""

from __future__ import annotations

import numpy as np

from estimator.diagnosis.line.motion import motion_of
from estimator.physics.driveline import Start
from estimator.physics.fit import fit
from estimator.physics.problem import make_problem
from tests.estimator.diagnosis.planted import drive_torque
from tests.estimator.physics.bench import ANGLE, LOAD_SPEED, SPEED, TWIST, TWO_MASS, exact_states, linear_record, model

START = Start(5.0, 0.0, 2.0, 0.0, 2.0)


def test_the_motion_of_a_fit_is_the_motion_of_the_line() -> None:
    records = [linear_record(TWO_MASS, drive_torque(seed), START, name=f"run_{seed}") for seed in (1, 2)]
    result = fit(make_problem(model(TWO_MASS), records, ()))
    states = exact_states(TWO_MASS, drive_torque(2), START)
    moved = motion_of(result, 1)
    for found, state in ((moved.speed, SPEED), (moved.twist, TWIST), (moved.load_speed, LOAD_SPEED)):
        assert np.max(np.abs(found - states[:, state])) < 1e-3 * np.ptp(states[:, state])
    assert np.max(np.abs(moved.angle - states[:, ANGLE])) < 1e-3 * np.ptp(states[:, ANGLE])
    np.testing.assert_array_equal(moved.torque, drive_torque(2))
