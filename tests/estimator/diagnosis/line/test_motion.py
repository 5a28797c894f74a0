"""The motion of a fit against the exact one of a linear line."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.line.blocks import (
    FormPlace,
    block_mean,
    form_changes,
    lines,
    motion_of,
)
from estimator.diagnosis.line.tangent import Tangent, block_length, tangent
from estimator.physics.driveline import InitialCondition
from estimator.physics.fit import FitResult, fit, not_fitted
from estimator.physics.model import EffectValue
from estimator.physics.problem import case_of, make_problem, start_vector
from estimator.physics.simulate import simulate_each
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
    record,
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


SAMPLES = 1500


def result_of(effects: dict[str, dict[str, float]] | None = None) -> FitResult:
    line = model(TWO_MASS)
    given = {name: {k: EffectValue(v, (v, v)) for k, v in e.items()} for name, e in (effects or {}).items()}
    rec = linear_record(TWO_MASS, drive_torque(1), START)
    return fit(make_problem(replace(line, effects=given), [rec], ()))


def walk(seed: int) -> FloatArray:
    return np.cumsum(np.random.default_rng(seed).standard_normal(SAMPLES))


def answer(line: Tangent, motor_nm: FloatArray, load_nm: FloatArray) -> FloatArray:
    """Return the output of a tangent under torques from rest, as its definition has it."""
    x, y = np.zeros(len(line.states)), np.empty(motor_nm.size)
    for b in range(motor_nm.size):
        i, u = (b if line.phi.shape[0] > 1 else 0), np.array([motor_nm[b], load_nm[b]])
        y[b] = line.c[i] @ x + line.d[i] @ u
        x = line.phi[i] @ x + line.gamma[i] @ u
    return y


@pytest.mark.parametrize("at_load", [False, True])
def test_a_linear_line_answers_exactly(at_load: bool) -> None:
    line = tangent(result_of(), 0, 1)
    assert line.phi.shape == (1, 3, 3)
    torque, nothing = walk(3), np.zeros(SAMPLES)
    motor, load = (nothing, torque) if at_load else (torque, nothing)
    exact = exact_states(TWO_MASS, motor, InitialCondition(0.0, 0.0, 0.0), extra_load_nm=load)[:, SPEED]
    assert np.max(np.abs(answer(line, motor, load) - exact)) < 1e-5 * np.ptp(exact)


@pytest.mark.parametrize("at_load", [False, True])
def test_a_line_with_a_gap_answers_as_its_simulation_does(at_load: bool) -> None:
    result = result_of({"backlash": {"gap_rad": 0.01, "contact_rad": 0.001}})
    line = tangent(result, 0, 1)
    assert line.phi.shape == (SAMPLES, 3, 3)
    force, nothing = 1e-4 * walk(4), np.zeros(SAMPLES)
    motor, load = (nothing, force) if at_load else (force, nothing)
    torque_nm = result.problem.records[0].torque_nm + motor[:, np.newaxis]
    pushed = replace(result.problem.records[0], torque_nm=torque_nm)
    case = replace(case_of(result.problem.local[0], result.p, result.local_of(0)), extra_load_nm=load)
    nudged = simulate_each(result.problem.grid, pushed, [case])[0] - result.outputs[0]
    assert np.max(np.abs(answer(line, motor, load) - nudged)) < 0.02 * np.ptp(nudged)


def test_fast_sampling_is_cut_into_blocks_and_slow_sampling_is_not() -> None:
    states = exact_states(TWO_MASS, drive_torque(1), START, sample_time_s=1e-3)
    slow = linear_record(TWO_MASS, drive_torque(1), START)
    fast = record(drive_torque(1), states[:, SPEED], sample_time_s=1e-3)
    result = fit(make_problem(model(TWO_MASS), [fast], ()))
    length = block_length(result)
    assert 5 <= length <= 10
    assert block_length(fit(make_problem(model(TWO_MASS), [slow], ()))) == 1
    (line,) = lines(result)
    assert line.size == 1500 // length
    middle = block_mean(states[:, TWIST], length)
    assert np.max(np.abs(line.motion.twist - middle)) < 0.02 * np.ptp(middle)


def test_a_line_that_grew_slower_keeps_its_blocks_where_they_are_asked_for() -> None:
    """A law over blocks is one of that length: blocks of the slower line's own would not match it."""
    stiff = {**TWO_MASS, "k": 4.0 * TWO_MASS["k"]}
    fast = record(drive_torque(1), exact_states(stiff, drive_torque(1), START, 1e-3)[:, SPEED], sample_time_s=1e-3)
    slower = fit(make_problem(model(TWO_MASS), [fast], ()))
    length = block_length(fit(make_problem(model(stiff), [fast], ())))
    assert block_length(slower) > length
    (line,) = lines(slower, length=length)
    assert line.length == length
    assert line.size == 1500 // length
