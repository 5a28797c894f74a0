"""Black boxes: each finds a system of its own kind again, and is judged on samples it has not seen."""

import importlib

import numpy as np
import pytest

from estimator.identification.linear_model import LinearModel
from estimator.physics.model import DrivelineModel, Motion, Parameter, Structure
from estimator.signals.record import OutputKind, Record
from hil.proof.real.black_box import sparse
from hil.proof.real.black_box.compare import Split, compare
from hil.proof.real.black_box.features import free_runs, powers, table
from hil.proof.real.black_box.linear import fit_linear, simulate_linear
from hil.proof.real.black_box.series import spread, stretches
from hil.proof.real.black_box.sparse import PySindyMissing, fit_sparse, require_pysindy, simulate_sparse, states
from hil.proof.real.case_file import Measure
from tests.proof.real import made_up

TIME_S = np.arange(made_up.N) * made_up.PERIOD_S
EVERYWHERE = np.ones(made_up.N, dtype=bool)
MODEL = DrivelineModel(
    structure=Structure.ONE_MASS,
    motion=Motion.TRANSLATION,
    parameters={"J_M": Parameter(made_up.MASS_KG, 0.1), "b_M": Parameter(made_up.VISCOUS, 0.1)},
)


def trolley(seed, okay=EVERYWHERE):
    force = made_up.force_n(seed)
    return Record(f"trolley_{seed}", made_up.PERIOD_S, TIME_S, force[:, np.newaxis], made_up.speed_m_s(force), okay)


def test_long_gaps_cut_a_recording_and_short_stretches_are_left_out():
    okay = EVERYWHERE.copy()
    okay[100:130] = okay[140:180] = False
    parts = stretches(trolley(1, okay), okay, made_up.PERIOD_S, 50)
    assert [int(part.used.sum()) for part in parts] == [100, 220]
    course = spread(parts, [part.output for part in parts], made_up.N)
    assert np.isfinite(course[:100]).all()
    assert np.isnan(course[135])


def test_a_lower_rate_takes_the_mean_of_the_force_and_the_speed_at_the_row():
    record = trolley(1)
    (part,) = stretches(record, EVERYWHERE, 5 * made_up.PERIOD_S, 10)
    np.testing.assert_array_equal(part.rows, np.arange(0, made_up.N, 5))
    np.testing.assert_allclose(part.main_input, record.total_torque_nm.reshape(-1, 5).mean(axis=1))
    np.testing.assert_array_equal(part.output, record.output[::5])
    assert part.sample_time_s == pytest.approx(0.5)


def test_a_linear_system_with_an_offset_is_found_again_and_predicts_another_recording():
    true = LinearModel((-1.6, 0.9, -0.1, 0.02), (0.02, 0.03, 0.01, 0.005), 1, made_up.PERIOD_S)

    def recorded(seed, offset):
        force = made_up.force_n(seed)
        y = true.simulate(force - 200.0, np.array([1.0, 0.5, 0.0, 0.0])) + offset
        return Record(f"linear_{seed}", made_up.PERIOD_S, TIME_S, force[:, np.newaxis], y, EVERYWHERE)

    def parts(record, used):
        return stretches(record, used, made_up.PERIOD_S, 20)

    model = fit_linear([*parts(recorded(1, 3.0), EVERYWHERE), *parts(recorded(2, -1.0), EVERYWHERE)])
    early = TIME_S < 20.0
    (unseen,) = parts(recorded(3, 7.0), early)
    error = simulate_linear(model, unseen) - unseen.output
    assert np.sqrt(np.mean(error[~early] ** 2)) < 1e-4 * np.std(unseen.output)


def test_a_position_that_drifts_is_predicted():
    """A mass pushed about: two integrators, of which the linear model must find both."""
    parts = [part for seed in (1, 2) for part in stretches(pushed(seed), EVERYWHERE, made_up.PERIOD_S, 50)]
    model = fit_linear(parts)
    (unseen,) = stretches(pushed(3), EVERYWHERE, made_up.PERIOD_S, 50)
    error = simulate_linear(model, unseen) - unseen.output
    assert np.sqrt(np.mean(error**2)) < 0.01 * np.std(unseen.output)


def pushed(seed):
    force = made_up.force_n(seed) - 350.0
    speed = np.cumsum(np.concatenate([[0.0], 0.001 * force[:-1]]))
    position = np.cumsum(np.concatenate([[0.0], made_up.PERIOD_S * speed[:-1]]))
    return Record("p", made_up.PERIOD_S, TIME_S, force[:, np.newaxis], position, EVERYWHERE, kind=OutputKind.POSITION)


def test_features_are_monomials_signs_and_squares_with_sign():
    z = np.array([[2.0, -3.0]])
    assert powers(2, 2).tolist() == [[0, 0], [1, 0], [0, 1], [2, 0], [1, 1], [0, 2]]
    assert table(z, powers(2, 2)).tolist() == [[1.0, 2.0, -3.0, 4.0, -6.0, 9.0, 1.0, -1.0, 4.0, -9.0]]


def test_a_free_run_is_that_of_the_law():
    """dx/dt = -x + u + c from x = 1: known in closed form."""
    exponents = powers(2, 1)
    xi = np.zeros((1, table(np.ones((1, 2)), exponents).shape[1]))
    xi[0, 1:3] = -1.0, 1.0
    time_s = 0.1 * np.arange(50)
    (run,) = free_runs(np.array([[1.0, 0.25]]), np.full((50, 1), 0.5), xi, exponents, 0.1)
    np.testing.assert_allclose(run, 0.75 + 0.25 * np.exp(-time_s), atol=1e-7)


def test_a_law_that_runs_away_stays_finite():
    exponents = powers(1, 3)
    xi = np.zeros((1, table(np.ones((1, 1)), exponents).shape[1]))
    xi[0, 3] = 1.0  # dx/dt = x^3
    assert np.isfinite(free_runs(np.array([[2.0, 0.0]]), np.zeros((400, 0)), xi, exponents, 0.1)).all()


def test_the_state_of_a_position_has_its_rate():
    position = Record("p", 0.1, TIME_S, np.ones((made_up.N, 1)), 3.0 * TIME_S, EVERYWHERE, kind=OutputKind.POSITION)
    (part,) = stretches(position, EVERYWHERE, 0.1, 10)
    np.testing.assert_allclose(states(part)[:, 1], 3.0)


@pytest.fixture
def pysindy():
    return pytest.importorskip("pysindy", reason="PySINDy is not installed: the sparse black box can't be tried")


@pytest.mark.usefixtures("pysindy")
def test_drag_is_found_again_by_sparse_regression():
    training = [part for seed in (1, 2) for part in stretches(trolley(seed), EVERYWHERE, made_up.PERIOD_S, 50)]
    model = fit_sparse(training)
    (unseen,) = stretches(trolley(3), EVERYWHERE, made_up.PERIOD_S, 50)
    error = simulate_sparse(model, unseen) - unseen.output
    # A slope over seven samples smears the force's steps, so the law is found roughly.
    assert np.sqrt(np.mean(error**2)) < 0.1 * np.std(unseen.output)


def missing(monkeypatch):
    def absent(name):
        raise ModuleNotFoundError(f"No module named {name!r}")

    monkeypatch.setattr(importlib, "import_module", absent)


def test_without_pysindy_it_is_said_what_is_missing(monkeypatch):
    missing(monkeypatch)
    with pytest.raises(PySindyMissing, match="Install pysindy"):
        require_pysindy()


def test_a_black_box_that_can_not_be_fitted_says_why(monkeypatch):
    missing(monkeypatch)
    record = trolley(1)
    late = TIME_S >= 20.0
    seen = {record.name: ~late}
    split = Split({record.name: record}, seen, seen, {record.name: late})
    linear, without = compare(split, Measure.RMS, MODEL, made_up.PERIOD_S)
    assert 0.0 < linear.held_out[record.name] < np.std(record.output)
    assert without.held_out == {}
    assert without.reason is not None
    assert "PySINDy" in without.reason


def test_recordings_too_short_for_a_fit_are_said_to_be(monkeypatch):
    monkeypatch.setattr(sparse, "require_pysindy", lambda: pytest.fail("nothing is to be fitted"))
    record = trolley(1)
    split = Split({record.name: record}, {record.name: TIME_S < 2.0}, {}, {})
    assert all(box.reason is not None and "no stretch" in box.reason for box in compare(split, Measure.RMS, MODEL, 0.1))
