"""The line of a fit: its motion, its answer to a torque, and how its laws change."""

from __future__ import annotations

import numpy as np
import pytest

from estimator.diagnosis.line.line import FormPlace, form_changes, line_of, motion_of
from estimator.physics.driveline import InitialCondition
from estimator.physics.fit import fit, not_fitted
from estimator.physics.problem import make_problem, start_vector
from estimator.signals.record import FloatArray
from tests.estimator.diagnosis.planted import drive_torque
from tests.estimator.physics.bench import (
    ANGLE,
    LOAD_SPEED,
    SAMPLE_TIME_S,
    SPEED,
    TWIST,
    TWO_MASS,
    exact_states,
    linear_record,
    model,
)

START = InitialCondition(5.0, 0.0, 2.0, 0.0, 2.0)


def test_the_motion_of_a_fit_is_the_motion_of_the_line() -> None:
    records = [linear_record(TWO_MASS, drive_torque(seed), START, name=f"run_{seed}") for seed in (1, 2)]
    result = fit(make_problem(model(TWO_MASS), records, ()))
    states = exact_states(TWO_MASS, drive_torque(2), START)
    moved = motion_of(result, 1)
    for found, state in ((moved.speed, SPEED), (moved.twist, TWIST), (moved.load_speed, LOAD_SPEED)):
        assert np.max(np.abs(found - states[:, state])) < 1e-3 * np.ptp(states[:, state])
    assert np.max(np.abs(moved.angle - states[:, ANGLE])) < 1e-3 * np.ptp(states[:, ANGLE])
    np.testing.assert_array_equal(moved.torque, drive_torque(2))
    middle = 0.5 * (states[1:, TWIST] + states[:-1, TWIST])
    assert np.max(np.abs(motion_of(result, 1, is_between=True).twist[:-1] - middle)) < 1e-3 * np.ptp(middle)


@pytest.mark.parametrize("at_load", [False, True])
def test_the_linear_line_answers_exactly(at_load: bool) -> None:
    line = line_of(fit(make_problem(model(TWO_MASS), [linear_record(TWO_MASS, drive_torque(1), START)], ())))
    torque, nothing = np.cumsum(np.random.default_rng(3).standard_normal(1500)), np.zeros(1500)
    motor, load = (nothing, torque) if at_load else (torque, nothing)
    x, found = np.zeros(line.torque.size), np.empty(torque.size)
    for t in range(torque.size):
        found[t] = line.h[0] @ x
        x = line.f @ x + line.torque * motor[t] + line.load * load[t]
    exact = exact_states(TWO_MASS, motor, InitialCondition(0.0, 0.0, 0.0), extra_load_nm=load)[:, SPEED]
    assert np.max(np.abs(found - exact)) < 1e-5 * np.ptp(exact)


SIZE_NM, GAP_RAD = 15.0, 0.02
TIME_S = np.arange(600) * SAMPLE_TIME_S
TORQUE_NM = 200.0 * np.sin(2.0 * np.pi * TIME_S / 3.0)


def changes(**effects: dict[str, float]) -> FloatArray:
    """Return the changes of the laws of a line that swings there and back twice."""
    record = linear_record(TWO_MASS, TORQUE_NM, InitialCondition(0.0, 0.0, -3.0, 0.0, -3.0))
    problem = make_problem(model(TWO_MASS, effects=effects), [record], ())
    return form_changes(not_fitted(problem, start_vector(problem)), 0)


def test_dry_friction_changes_by_twice_its_size_at_a_reversal_and_at_its_place() -> None:
    at_motor = changes(coulomb_friction_motor={"friction_nm": SIZE_NM})
    assert at_motor[FormPlace.MOTOR].max() == 2.0 * SIZE_NM
    assert 0 < np.count_nonzero(at_motor) < 0.2 * TIME_S.size
    assert not at_motor[[FormPlace.LOAD, FormPlace.SHAFT]].any()
    at_load = changes(coulomb_friction_load={"friction_nm": SIZE_NM})
    assert at_load[FormPlace.LOAD].max() == 2.0 * SIZE_NM
    assert not at_load[[FormPlace.MOTOR, FormPlace.SHAFT]].any()


def test_a_gap_changes_what_the_shaft_carries_while_it_is_crossed() -> None:
    in_shaft = changes(backlash={"gap_rad": GAP_RAD, "contact_rad": 1e-3})
    assert 0.0 < in_shaft[FormPlace.SHAFT].max() <= TWO_MASS["k"] * GAP_RAD
    assert not in_shaft[[FormPlace.MOTOR, FormPlace.LOAD]].any()
