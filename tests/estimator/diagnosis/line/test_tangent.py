"""The linearised line against the exact response of a linear one, and against nudges of a nonlinear one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.line.blocks import block_mean, simulated
from estimator.diagnosis.line.tangent import tangent
from estimator.physics.driveline import Start
from estimator.physics.fit import FitResult, fit
from estimator.physics.model import EffectValue
from estimator.physics.problem import make_problem
from estimator.signals.record import FloatArray
from tests.estimator.diagnosis.planted import drive_torque
from tests.estimator.physics.bench import SPEED, TWO_MASS, exact_states, linear_record, model

START = Start(5.0, 0.0, 2.0, 0.0, 2.0)
SAMPLES = 1500


def result_of(effects: dict[str, dict[str, float]] | None = None) -> FitResult:
    line = model(TWO_MASS)
    given = {name: {k: EffectValue(v, (v, v)) for k, v in e.items()} for name, e in (effects or {}).items()}
    rec = linear_record(TWO_MASS, drive_torque(1), START)
    return fit(make_problem(replace(line, effects=given), [rec], ()))


def walk(seed: int) -> FloatArray:
    return np.cumsum(np.random.default_rng(seed).standard_normal(SAMPLES))


@pytest.mark.parametrize("at_load", [False, True])
def test_a_linear_line_answers_exactly(at_load: bool) -> None:
    line = tangent(result_of(), 0, 1)
    assert line.phi.shape == (1, 3, 3)
    torque, nothing = walk(3), np.zeros(SAMPLES)
    motor, load = (nothing, torque) if at_load else (torque, nothing)
    exact = exact_states(TWO_MASS, motor, Start(0.0, 0.0, 0.0), extra_load_nm=load)[:, SPEED]
    assert np.max(np.abs(line.answer(motor, load) - exact)) < 1e-5 * np.ptp(exact)


def test_the_answer_to_an_initial_state_is_the_free_motion() -> None:
    line = tangent(result_of(), 0, 1)
    start = Start(0.0, 0.0, 0.0, twist_rad=float(line.scale[1]))
    exact = exact_states(TWO_MASS, np.zeros(SAMPLES), start)[:, SPEED]
    np.testing.assert_allclose(line.free(SAMPLES)[1], exact, atol=1e-4 * np.ptp(exact))


@pytest.mark.parametrize("at_load", [False, True])
def test_a_line_with_a_gap_answers_as_its_simulation_does(at_load: bool) -> None:
    result = result_of({"backlash": {"gap_rad": 0.01, "contact_rad": 0.001}})
    line = tangent(result, 0, 1)
    assert line.phi.shape == (SAMPLES, 3, 3)
    force, nothing = 1e-4 * walk(4), np.zeros(SAMPLES)
    motor, load = (nothing, force) if at_load else (force, nothing)
    nudged = simulated(result, 0, (motor, load)) - result.outputs[0]
    assert np.max(np.abs(line.answer(motor, load) - nudged)) < 0.02 * np.ptp(nudged)


@pytest.mark.parametrize("effects", [None, {"backlash": {"gap_rad": 0.01, "contact_rad": 0.001}}])
def test_many_answers_at_once_are_those_to_each_alone(effects: dict[str, dict[str, float]] | None) -> None:
    line = tangent(result_of(effects), 0, 1)
    late = np.where(np.arange(SAMPLES) >= 700, walk(6), 0.0)
    torques = np.array([walk(5), late, np.zeros(SAMPLES)])
    expected = [line.answer(-each, 0.5 * each) for each in torques]
    found = line.answers(-1.0, 0.5, torques)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
    assert not found[1, :700].any()


def test_blocks_of_samples_are_their_average() -> None:
    result = result_of()
    fine, coarse = tangent(result, 0, 1), tangent(result, 0, 5)
    held = np.repeat(walk(5)[: SAMPLES // 5], 5)
    nothing = np.zeros(SAMPLES)
    expected = block_mean(fine.answer(held, nothing), 5)
    found = coarse.answer(held[::5], nothing[::5])
    assert np.max(np.abs(found - expected)) < 1e-4 * np.ptp(expected)
