"""Errors of free runs, and the force and the load that they stand for."""

import numpy as np
import pytest

from estimator.physics.model import DrivelineModel, EffectValue, Motion, Parameter, Structure
from estimator.signals.record import Record
from hil.proof.real.case_file import Measure
from hil.proof.real.grade import correlation, low_passed, true_grade
from hil.proof.real.measure import error_of, force_error, load_course
from tests.proof.real import made_up

MODEL = DrivelineModel(
    structure=Structure.ONE_MASS,
    motion=Motion.TRANSLATION,
    parameters={"J_M": Parameter(made_up.MASS_KG, 0.1), "b_M": Parameter(made_up.VISCOUS, 0.1)},
    effects={"aerodynamic_drag": {"drag_nm_s2": EffectValue(made_up.DRAG)}},
)
TIME_S = np.arange(made_up.N) * made_up.PERIOD_S


def record(force, speed, okay=None):
    okay = np.ones(made_up.N, dtype=bool) if okay is None else okay
    return Record("trolley", made_up.PERIOD_S, TIME_S, force[:, np.newaxis], speed, okay)


@pytest.fixture
def driven():
    force = made_up.force_n(3)
    return record(force, made_up.speed_m_s(force))


def test_rms_counts_judged_samples_alone(driven):
    judged = np.zeros(made_up.N, dtype=bool)
    judged[50:60] = True
    simulated = driven.output + np.where(judged, 0.2, 7.0)
    assert error_of(Measure.RMS, driven, simulated, judged, MODEL) == pytest.approx(0.2)


def test_nrmse_is_one_for_the_mean(driven):
    mean = np.full(made_up.N, driven.output.mean())
    assert error_of(Measure.NRMSE, driven, mean, driven.okay, MODEL) == pytest.approx(1.0)


def test_a_run_that_is_lost_has_no_finite_error(driven):
    simulated = driven.output.copy()
    simulated[7] = np.nan
    assert error_of(Measure.RMS, driven, simulated, driven.okay, MODEL) == np.inf


def test_the_force_error_of_a_load_left_out_is_that_load():
    """A trolley that is slowed by a slow wave of load; the model that does not know it lacks just that force."""
    force = made_up.force_n(4)
    load = 60.0 * np.sin(2 * np.pi * TIME_S / 20.0)
    measured = record(force, made_up.speed_m_s(force, load))
    lacking = force_error(measured, made_up.speed_m_s(force), MODEL)
    inner = np.isfinite(lacking)
    assert inner.sum() == made_up.N - 10  # half a second at either end
    np.testing.assert_allclose(lacking[inner], load[inner], atol=4.0)


def test_the_force_error_is_not_known_next_to_missing_speed(driven):
    okay = driven.okay.copy()
    okay[200] = False
    lacking = force_error(record(driven.total_torque_nm, driven.output, okay), driven.output, MODEL)
    assert np.isnan(lacking[195:206]).all()
    assert np.isfinite(lacking[[194, 206]]).all()


def test_force_nrmse_is_the_lacking_force_over_the_spread_of_the_force(driven):
    force = driven.total_torque_nm
    slower = record(force, made_up.speed_m_s(force, 50.0))
    got = error_of(Measure.FORCE_NRMSE, slower, driven.output, slower.okay, MODEL)
    assert got == pytest.approx(50.0 / float(np.std(force)), rel=0.05)


def test_the_load_of_a_free_run_is_found_again():
    force = made_up.force_n(5)
    load = 40.0 + 30.0 * np.cos(2 * np.pi * TIME_S / 15.0)
    found = load_course(record(force, made_up.speed_m_s(force)), made_up.speed_m_s(force, load), MODEL)
    np.testing.assert_allclose(found[:-1], load[:-1], rtol=1e-6)
    assert np.isnan(found[-1])


def test_the_accelerometer_less_the_rise_of_the_speed_is_the_grade():
    speed = 10.0 + np.sin(0.1 * TIME_S)
    grade = true_grade(0.1 * np.cos(0.1 * TIME_S) + 0.3, speed, made_up.PERIOD_S)
    np.testing.assert_allclose(grade[1:-1], 0.3, atol=1e-4)


def test_a_low_pass_keeps_a_constant_also_next_to_gaps():
    there = np.ones(made_up.N, dtype=bool)
    there[100:180] = False
    np.testing.assert_allclose(low_passed(np.full(made_up.N, 2.0), there, 0.1, made_up.PERIOD_S)[there], 2.0, rtol=1e-6)


def test_correlation_sees_the_course_through_noise_and_not_the_sign_of_nothing():
    rng = np.random.default_rng(1)
    course = np.sin(2 * np.pi * TIME_S / 30.0)
    there = rng.random(made_up.N) > 0.2
    noisy = course + rng.normal(0.0, 1.0, made_up.N)
    assert correlation(600.0 * course + 50.0, noisy, there, 0.1, made_up.PERIOD_S) > 0.9
    assert correlation(-course, noisy, there, 0.1, made_up.PERIOD_S) < -0.9
    assert correlation(np.full(made_up.N, 3.0), noisy, there, 0.1, made_up.PERIOD_S) is None
    assert correlation(course, noisy, np.zeros(made_up.N, dtype=bool), 0.1, made_up.PERIOD_S) is None
