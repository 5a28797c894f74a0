"""The noise floor on recordings of known noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.noise import noise_floor, unpredictable
from estimator.physics.driveline import Start
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


class TestUnpredictable:
    """What a series' own past does not predict."""

    @pytest.mark.parametrize("a", [0.0, 0.5, 0.9])
    def test_of_a_first_order_series_it_is_the_innovation(self, a: float) -> None:
        rng = np.random.default_rng(9)
        errors = [autoregressive(a, 4000, rng), autoregressive(a, 2000, rng)]
        assert unpredictable(errors) == pytest.approx(np.sqrt(1.0 - a**2), rel=0.05)

    def test_a_slow_swing_is_predicted_and_the_noise_on_it_is_not(self) -> None:
        time_s = np.arange(4000) * 0.01
        noise = 0.05 * np.random.default_rng(10).standard_normal(4000)
        assert unpredictable([np.sin(2 * np.pi * 0.3 * time_s) + noise]) == pytest.approx(0.05, rel=0.15)
