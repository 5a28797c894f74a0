"""A model on a recording: only load torque and initial state are estimated."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.errors import BadModel
from estimator.physics.driveline import Start
from estimator.physics.fit import fit
from estimator.physics.free_run import free_run
from estimator.physics.layout import flat, grid_for
from estimator.physics.problem import make_problem
from estimator.physics.simulate import simulate
from estimator.signals.record import Location, OutputKind
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, linear_record, model, random_steps, record, scaled

START = Start(25.0, 0.0, 8.0, 0.01, 7.5)


def test_with_the_true_model_only_the_noise_is_left() -> None:
    rec = linear_record(TWO_MASS, random_steps(1500, seed=1), START, sigma=0.05)
    clean = linear_record(TWO_MASS, random_steps(1500, seed=1), START)
    run = free_run(model(TWO_MASS), rec)
    assert run.rms == pytest.approx(0.05, rel=0.06)  # 1500 samples: 1.8 % standard error
    np.testing.assert_allclose(run.output, clean.output, atol=0.05)
    assert run.start.load_torque_nm == pytest.approx(25.0, abs=1.0)
    assert run.start.speed_rad_s == pytest.approx(8.0, abs=0.1)


def test_a_position_brings_its_own_start_angle() -> None:
    start = replace(START, angle_rad=3.0)
    rec = linear_record(ONE_MASS, random_steps(800, seed=2), start, sigma=1e-4, kind=OutputKind.POSITION)
    run = free_run(model(ONE_MASS), rec)
    assert run.start.angle_rad == pytest.approx(3.0, abs=1e-3)
    assert run.rms == pytest.approx(1e-4, rel=0.1)


def test_nothing_else_of_the_model_is_tuned() -> None:
    """A wrong inertia stays wrong, however large its tolerance."""
    rec = linear_record(ONE_MASS, random_steps(800, seed=3), START, sigma=0.05)
    wrong = scaled(ONE_MASS, J_M=1.3)
    tight, loose = (free_run(model(wrong, tolerance), rec) for tolerance in (0.0, 0.9))
    assert tight.rms > 0.2
    np.testing.assert_array_equal(tight.output, loose.output)


def test_an_effect_of_the_model_acts() -> None:
    torque = random_steps(800, seed=4)
    late = np.concatenate([np.full(3, torque[0]), torque[:-3]])
    rec = replace(linear_record(ONE_MASS, late, START, sigma=0.05), torque_nm=torque[:, None])
    delayed = model(ONE_MASS, effects={"transport_delay": {"delay_s": 0.03}})
    assert free_run(delayed, rec).rms == pytest.approx(0.05, rel=0.1)
    assert free_run(model(ONE_MASS), rec).rms > 0.1


def test_masked_samples_are_simulated_but_not_judged() -> None:
    rec = linear_record(ONE_MASS, random_steps(800, seed=5), START, sigma=0.05)
    okay = np.arange(800) % 7 != 0
    holed = replace(rec, okay=okay, output=np.where(okay, rec.output, np.nan))
    run = free_run(model(ONE_MASS), holed)
    assert run.rms == pytest.approx(0.05, rel=0.1)
    assert np.isfinite(run.output).all()


def test_an_output_that_the_structure_lacks_is_refused() -> None:
    rec = linear_record(TWO_MASS, random_steps(400, seed=8), START, location=Location.LOAD)
    with pytest.raises(BadModel, match="speed at the load is no output of one_mass"):
        free_run(model(ONE_MASS), rec)


@pytest.mark.parametrize(("seed", "twist_rad", "speed_rad_s"), [(8, 0.06, 0.0), (10, -0.06, 0.0), (5, -0.06, 0.5)])
def test_a_recording_may_begin_on_either_flank_of_a_gap(seed: int, twist_rad: float, speed_rad_s: float) -> None:
    """The mean load tells the flank of the average, not that of the first sample: from there the fit gets stuck."""
    geared = model(TWO_MASS, effects={"backlash": {"gap_rad": 0.1, "contact_rad": 1e-3}})
    torque = random_steps(400, seed, size_nm=60.0, hold=40)
    blank = record(torque, np.ones(400))
    start = Start(0.0, 0.0, speed_rad_s, twist_rad, speed_rad_s)
    clean = simulate(grid_for(geared, [blank]), blank, flat(geared), start)
    noise = 0.02 * np.random.default_rng(9).standard_normal(400)
    rec = record(torque, clean + noise)
    assert fit(make_problem(geared, [rec], ())).rms > 0.05
    assert free_run(geared, rec).rms == pytest.approx(0.02, rel=0.1)
