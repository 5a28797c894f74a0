"""The noise floor on recordings of known noise, and correlation lengths against the closed formula."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.noise import PREDICTOR_ORDER, correlation_length, effective_samples, noise_floor, unpredictable
from estimator.errors import NotExciting
from estimator.physics.simulate import Start
from estimator.signals.record import Record
from tests.estimator.diagnosis.regression import autoregressive
from tests.estimator.physics.bench import TWO_MASS, linear_record, random_steps

START = Start(20.0, 0.0, 10.0, 0.005, 10.0)
SIGMA = 0.05


def drive(sigma: float = SIGMA, seed: int = 1, samples: int = 3000) -> Record:
    return linear_record(TWO_MASS, random_steps(samples, seed), START, sigma=sigma, seed=seed, name=f"run_{seed}")


@pytest.mark.parametrize("sigma", [0.01, 0.05, 0.3])
def test_the_floor_of_a_linear_driveline_is_its_noise(sigma: float) -> None:
    """A predictor of finite order errs upward: it passes part of its past's noise on."""
    assert sigma * 0.97 < noise_floor([drive(sigma)]) < sigma * 1.15


def test_slow_physics_that_is_missing_is_not_noise() -> None:
    rec = drive()
    swing = 0.5 * np.sin(2 * np.pi * 0.2 * rec.time_s)
    assert noise_floor([replace(rec, output=rec.output + swing)]) < 1.15 * SIGMA


def test_quantisation_counts_as_its_uniform_noise() -> None:
    step = 0.2
    rec = drive(sigma=0.0)
    coarse = replace(rec, output=step * np.round(rec.output / step))
    assert noise_floor([coarse]) == pytest.approx(step / np.sqrt(12.0), rel=0.15)


def test_recordings_are_pooled_by_their_squares() -> None:
    quiet, loud = drive(0.02, seed=2), drive(0.2, seed=3)
    expected = np.sqrt(0.5 * (noise_floor([quiet]) ** 2 + noise_floor([loud]) ** 2))
    assert noise_floor([quiet, loud]) == pytest.approx(expected, rel=1e-9)


def test_what_a_masked_sample_holds_does_not_matter() -> None:
    rec = drive()
    okay = np.random.default_rng(4).random(rec.output.size) > 0.05
    spoilt = np.where(okay, rec.output, np.nan)
    floor = noise_floor([replace(rec, okay=okay, output=spoilt)])
    assert floor == noise_floor([replace(rec, okay=okay)])
    assert 0.97 * SIGMA < floor < 1.2 * SIGMA


@pytest.mark.parametrize("every", [5, 10, 15])
def test_a_sample_lost_in_every_few_does_not_hide_the_noise(every: int) -> None:
    """No window of twenty samples is whole here; a floor of zero would call any model wrong."""
    rec = drive()
    okay = np.arange(rec.output.size) % every != 0
    assert 0.97 * SIGMA < noise_floor([replace(rec, okay=okay)]) < 1.3 * SIGMA


def test_a_recording_with_hardly_two_good_samples_in_a_row_is_refused() -> None:
    rec = drive()
    okay = np.arange(rec.output.size) % 3 == 0
    message = f"run_1: 0 samples follow {PREDICTOR_ORDER} samples of which most are good, expected at least 82"
    with pytest.raises(NotExciting, match=message):
        noise_floor([replace(rec, okay=okay)])


def first_order_length(a: float) -> float:
    """1 + 2 sum a^(2k) = (1 + a^2) / (1 - a^2)."""
    return (1.0 + a**2) / (1.0 - a**2)


def expected_length(a: float) -> float:
    """What the estimate comes to: Bartlett's scatter l (N - k) / N^2 over N/4 lags, less the 1/N that is taken out."""
    true = first_order_length(a)
    return true + 2.0 * (true * (1.0 - 0.125) * 0.25 - 0.25)


@pytest.mark.parametrize("a", [0.0, 0.5, 0.8, 0.95, -0.7])
def test_the_correlation_length_of_a_first_order_series(a: float) -> None:
    rng = np.random.default_rng(5)
    lengths = [correlation_length([autoregressive(a, 5000, rng)]) for _ in range(20)]
    assert np.mean(lengths) == pytest.approx(expected_length(a), rel=0.1)


def test_it_errs_on_the_careful_side() -> None:
    assert first_order_length(0.8) < expected_length(0.8) < 1.44 * first_order_length(0.8)


def test_several_recordings_are_pooled() -> None:
    rng = np.random.default_rng(6)
    parts = [autoregressive(0.8, 5000, rng) for _ in range(20)]
    pooled = correlation_length(parts)
    assert first_order_length(0.8) < pooled < np.mean([correlation_length([part]) for part in parts])


def test_an_error_without_variation_counts_as_independent() -> None:
    assert correlation_length([np.full(100, 3.0)]) == 1.0


def test_effective_samples_are_samples_by_correlation_length() -> None:
    rng = np.random.default_rng(7)
    errors = [autoregressive(0.9, 5000, rng), autoregressive(0.9, 3000, rng)]
    assert effective_samples(errors) == 8000 / correlation_length(errors)


def test_the_effective_samples_give_the_scatter_of_the_mean_square() -> None:
    """For a Gaussian series of unit variance the mean square scatters with variance 2 / n_effective."""
    rng = np.random.default_rng(8)
    series = [autoregressive(0.9, 2000, rng) for _ in range(400)]
    scatter = np.var([np.mean(s**2) for s in series])
    n_effective = np.mean([effective_samples([s]) for s in series])
    errs_upward = expected_length(0.9) / first_order_length(0.9)
    assert scatter == pytest.approx(2.0 / (n_effective * errs_upward), rel=0.25)  # 400 runs: 7 % standard error


class TestUnpredictable:
    """What a series' own past does not foretell."""

    @pytest.mark.parametrize("a", [0.0, 0.5, 0.9])
    def test_of_a_first_order_series_it_is_the_innovation(self, a: float) -> None:
        rng = np.random.default_rng(9)
        errors = [autoregressive(a, 4000, rng), autoregressive(a, 2000, rng)]
        assert unpredictable(errors) == pytest.approx(np.sqrt(1.0 - a**2), rel=0.05)

    def test_a_slow_swing_is_foretold_and_the_noise_on_it_is_not(self) -> None:
        time_s = np.arange(4000) * 0.01
        noise = 0.05 * np.random.default_rng(10).standard_normal(4000)
        assert unpredictable([np.sin(2 * np.pi * 0.3 * time_s) + noise]) == pytest.approx(0.05, rel=0.15)
