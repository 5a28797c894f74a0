import numpy as np
import pytest

from estimator.errors import NotExciting
from estimator.identification.linear_model import LinearModel, Orders
from estimator.identification.offline import problem
from estimator.identification.offline.fits import LinearFit, fit_box_jenkins, fit_output_error
from estimator.signals.prbs import prbs_nm
from estimator.signals.record import BoolArray, FloatArray, Record

TRUTH = LinearModel(a=(-1.84, 1.65, -0.75), b=(0.02, 0.01, -0.015), nk=1, sample_time_s=0.02)
N = 1500


def record(y: FloatArray, okay: BoolArray | None = None, u: FloatArray | None = None) -> Record:
    n = y.shape[0]
    torque = prbs_nm(n, 60.0) if u is None else u
    mask = np.ones(n, dtype=bool) if okay is None else okay
    return Record("made", 0.02, 0.02 * np.arange(n), torque[:, np.newaxis], y, mask)


def noisy(seed: int, noise: float = 0.3, state: FloatArray | None = None) -> FloatArray:
    clean = TRUTH.simulate(prbs_nm(N, 60.0), state)
    return clean + noise * np.random.default_rng(seed).normal(size=N)


def fitted(y: FloatArray, okay: BoolArray | None = None) -> LinearFit:
    return fit_output_error(record(y, okay), TRUTH.orders)


def test_without_noise_the_truth_comes_out_exactly() -> None:
    fit = fitted(noisy(0, noise=0.0))
    np.testing.assert_allclose(fit.model.theta, TRUTH.theta, atol=1e-8)
    assert fit.rms < 1e-8
    assert fit.fit_percent > 99.9999


def test_with_noise_the_residual_falls_to_it_and_the_parameters_lie_in_their_intervals() -> None:
    deviations = []
    for seed in range(30):
        fit = fitted(noisy(seed))
        assert fit.rms == pytest.approx(0.3, rel=0.06)
        deviations.append((fit.model.theta - TRUTH.theta) / np.sqrt(np.diag(fit.covariance)))
    # 180 deviations in units of their standard deviation; 5 % of a normal variable lie beyond 1.96
    assert 0.80 < np.std(deviations) < 1.20
    assert np.mean(np.abs(deviations) > 1.96) < 0.12


def test_the_state_before_the_first_sample_is_estimated() -> None:
    state = np.array([40.0, -30.0, 25.0])
    fit = fitted(noisy(1, noise=0.05, state=state))
    np.testing.assert_allclose(fit.state[:-1], state, atol=0.3)
    assert fit.rms == pytest.approx(0.05, rel=0.06)


def test_forty_percent_masked_samples_do_not_bias_it() -> None:
    okay = np.random.default_rng(2).random(N) > 0.4
    y = np.where(okay, noisy(2), 1e5)  # what is masked must not be looked at
    fit = fitted(y, okay)
    deviation = (fit.model.theta - TRUTH.theta) / np.sqrt(np.diag(fit.covariance))
    assert np.abs(deviation).max() < 3.5
    assert fit.n_samples == np.count_nonzero(okay)
    assert fit.rms == pytest.approx(0.3, rel=0.06)


@pytest.mark.parametrize("silent", [0, 300])
def test_over_its_beginning_first_a_long_recording_gives_the_same(silent: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a beginning without an output, or one too short to tell, it is as if there had been none."""
    okay = np.ones(N, dtype=bool)
    okay[1:silent] = False
    whole = [fit(record(noisy(4), okay), TRUTH.orders) for fit in (fit_output_error, fit_box_jenkins)]
    monkeypatch.setattr(problem, "WHOLE", 400)
    monkeypatch.setattr(problem, "BEGINNING", 250)
    for before, fit in zip(whole, (fit_output_error, fit_box_jenkins), strict=True):
        found = fit(record(noisy(4), okay), TRUTH.orders)
        deviation = (found.model.theta - before.model.theta) / np.sqrt(np.diag(before.covariance))
        assert np.abs(deviation).max() < 1e-2


def test_masked_outputs_may_be_no_numbers_and_nothing_is_changed() -> None:
    okay = np.ones(N, dtype=bool)
    okay[:40] = okay[500:700] = False
    y = np.where(okay, noisy(3), np.nan)
    source = record(y, okay)
    before = (source.torque_nm.copy(), y.copy(), okay.copy())
    fit = fit_output_error(source, TRUTH.orders)
    assert fit.first == 40
    simulated = fit.simulate(source.total_torque_nm)
    assert np.sqrt(np.mean((simulated - y)[okay] ** 2)) == pytest.approx(fit.rms)
    assert not simulated[:40].any()
    for array, copy in zip((source.torque_nm, source.output, source.okay), before, strict=True):
        assert np.array_equal(array, copy, equal_nan=array.dtype == np.float64)


def test_the_model_is_stable_even_where_the_data_grow() -> None:
    growing = LinearModel((-1.002,), (0.05,), 1, 0.02).simulate(prbs_nm(N, 60.0))
    fit = fit_output_error(record(growing + np.random.default_rng(0).normal(size=N)), Orders(2, 2, 1))
    assert fit.model.is_stable


def test_data_that_do_not_determine_the_model_are_refused_by_parameter() -> None:
    sine = np.sin(0.3 * np.arange(N))
    with pytest.raises(NotExciting, match="excites 2 parameters, expected 6") as refusal:
        fit_output_error(record(TRUTH.simulate(sine), u=sine), TRUTH.orders)
    assert refusal.value.names == ("a_2", "a_3", "b_2", "b_3")
