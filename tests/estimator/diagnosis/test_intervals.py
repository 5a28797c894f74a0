"""Coverage of the 95 % intervals, on white errors and on correlated ones."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from estimator.diagnosis.assemble import interval, interval_that_follows
from estimator.diagnosis.covariance import Z95, covariance, reported_covariance
from estimator.diagnosis.inference.figures import bic_gained
from estimator.diagnosis.inference.remainder import unpredictable
from estimator.diagnosis.noise import noise_floor
from estimator.physics.driveline import InitialCondition
from estimator.physics.fit import FitResult
from estimator.signals.correlation import effective_samples
from estimator.signals.record import FloatArray, Record
from tests.estimator.diagnosis.regression import autoregressive, regression
from tests.estimator.physics.bench import TWO_MASS, linear_record, random_steps

REPETITIONS, SAMPLES = 200, 2000
TRUE = np.array([1.0, 2.0, 3.0])


def coverage(correlation: float) -> np.ndarray:
    """Share of intervals that hold the truth: of a mean, of a regressor correlated like the error, of a white one."""
    hits = np.zeros(3)
    for seed in range(REPETITIONS):
        rng = np.random.default_rng(seed)
        regressors = [np.ones(SAMPLES), autoregressive(correlation, SAMPLES, rng), rng.standard_normal(SAMPLES)]
        design = np.column_stack(regressors)
        output = design @ TRUE + autoregressive(correlation, SAMPLES, rng)
        half = SAMPLES // 2
        result = regression([design[:half], design[half:]], [output[:half], output[half:]])
        cov = covariance(result)
        for i, true in enumerate(TRUE):
            low, high = interval(result, cov, i)
            hits[i] += low <= true <= high
    return hits / REPETITIONS


def least(share: float) -> float:
    """Lowest share to be expected in the repetitions, with 99.9 %."""
    return float(stats.binom.ppf(0.001, REPETITIONS, share)) / REPETITIONS


def bartlett(correlation: float, window: int) -> float:
    """Share of a first-order series' long-run variance that a Bartlett window sees."""
    lags = np.arange(1, window)
    seen = 1.0 + 2.0 * np.sum((1.0 - lags / window) * correlation**lags)
    return float(seen * (1.0 - correlation) / (1.0 + correlation))


def test_white_errors_are_covered_at_the_level() -> None:
    for share in coverage(0.0):
        assert least(0.95) <= share <= 0.995


@pytest.mark.parametrize("correlation", [0.8, 0.9])
def test_correlated_errors_are_covered_as_well_as_the_window_sees_them(correlation: float) -> None:
    mean, alike, white = coverage(correlation)
    window = int(4.0 * (1 + correlation**2) / (1 - correlation**2))
    expected = 2.0 * stats.norm.cdf(Z95 * np.sqrt(bartlett(correlation, window))) - 1.0
    assert expected > 0.9
    assert mean >= least(expected)
    assert alike >= least(expected)
    assert white >= least(0.95)


@pytest.mark.parametrize("beyond", [-1.0, 1.0])
def test_an_interval_begins_before_it_ends_where_a_fit_is_beyond_a_bound_by_its_last_digit(beyond: float) -> None:
    rng = np.random.default_rng(2)
    design = rng.standard_normal((200, 1))
    result = regression([design], [design[:, 0]])
    held = float(np.nextafter(result.x[0], beyond * np.inf))
    shared = replace(result.problem.shared[0], low=held, high=held)
    pinned = replace(result, problem=replace(result.problem, shared=(shared,)))
    low, high = interval(pinned, np.zeros((1, 1)), 0)
    assert low == high == shared.scale * held


def test_a_nominal_parameter_at_the_edge_of_its_tolerance_keeps_its_uncertainty() -> None:
    rng = np.random.default_rng(3)
    design = rng.standard_normal((400, 2))
    result = regression([design], [design @ [0.2, 1.2] + rng.standard_normal(400)], bound=1.0)
    cov = covariance(result)
    assert result.x[1] == 1.0
    low, high = interval(result, cov, 1)
    assert low == pytest.approx(1.0 - Z95 * np.sqrt(cov[1, 1]))
    assert low < 0.95
    assert high == 1.0


def test_an_effects_parameter_at_its_bound_is_held_there() -> None:
    rng = np.random.default_rng(3)
    design = rng.standard_normal((400, 2))
    result = regression([design], [design @ [0.2, 4.0] + rng.standard_normal(400)], bound=1.0, effect="backlash")
    cov = covariance(result)
    assert result.x[1] == 1.0
    np.testing.assert_array_equal(cov[1], [0.0, 0.0])
    assert interval(result, cov, 1) == (1.0, 1.0)
    assert cov[0, 0] > 0.0


def test_what_is_reported_of_it_goes_one_way_from_the_bound() -> None:
    """By as much as without the bound; all else is known as well as with the parameter held."""
    rng = np.random.default_rng(3)
    design = rng.standard_normal((400, 2))
    data = [design @ [0.2, 1.1] + rng.standard_normal(400)]
    at, beyond = (regression([design], data, bound=bound, effect="backlash") for bound in (1.0, 2.0))
    assert at.x[1] == 1.0 < beyond.x[1]
    cov, free = reported_covariance(at), reported_covariance(beyond)
    np.testing.assert_array_equal(cov[0, 1:], 0.0)
    low, high = interval(at, cov, 1)
    assert high == 1.0
    assert 1.0 - low == pytest.approx(Z95 * np.sqrt(free[1, 1]), rel=0.1)


class TestReported:
    """White errors of the regression's own, and in addition one that keeps its value for a second."""

    SIGMA, SAMPLES = 0.1, 9000

    def errors(self, coherent: float, seed: int) -> FloatArray:
        rng = np.random.default_rng(seed)
        held = np.repeat(rng.standard_normal(self.SAMPLES // 100), 100)
        noise: FloatArray = self.SIGMA * rng.standard_normal(self.SAMPLES) + coherent * held
        return noise

    def result(self, coherent: float, seed: int = 1) -> FitResult:
        rng = np.random.default_rng(100 + seed)
        held = np.repeat(rng.standard_normal((self.SAMPLES // 100, 3)), 100, axis=0)
        return regression([held], [held @ TRUE + self.errors(coherent, seed)])

    def test_what_is_no_noise_counts_for_as_long_as_it_keeps_its_value(self) -> None:
        """100 times its mean square takes the place of sigma^2; from twenty noisy values some of it is predicted."""
        result = self.result(0.05)
        added = np.diag(reported_covariance(result) - covariance(result))
        j = result.jacobian
        share = added / (100 * 0.05**2 * np.diag(np.linalg.inv(j.T @ j)))
        assert (share > 0.3).all()
        assert (share < 1.0).all()

    def test_the_truth_is_inside_although_part_of_the_error_is_coherent(self) -> None:
        hits = []
        for seed in range(100):
            result = self.result(0.05, seed)
            cov = reported_covariance(result)
            hits += [
                low <= true <= high
                for true, (low, high) in zip(TRUE, (interval(result, cov, i) for i in range(3)), strict=True)
            ]
        assert np.mean(hits) >= 0.9


def test_the_interval_of_what_follows_is_that_of_the_formula() -> None:
    """Of a product, the relative variances add up with the covariance: the delta method."""
    rng = np.random.default_rng(0)
    design = rng.standard_normal((SAMPLES, 3))
    result = regression([design], [design @ TRUE + rng.standard_normal(SAMPLES)])
    cov = covariance(result)
    a, b = result.x[:2]
    low, high = interval_that_follows(result, cov, lambda fit: float(fit.x[0] * fit.x[1]))
    spread = Z95 * np.sqrt(b**2 * cov[0, 0] + a**2 * cov[1, 1] + 2.0 * a * b * cov[0, 1])
    assert (low, high) == pytest.approx((a * b - spread, a * b + spread), rel=1e-6)


def test_the_interval_of_what_follows_stays_on_its_side_of_zero() -> None:
    design = np.random.default_rng(0).standard_normal((20, 1))
    result = regression([design], [0.01 * design[:, 0] + np.random.default_rng(1).standard_normal(20)])
    cov = covariance(result)
    size = abs(float(result.x[0]))
    assert interval_that_follows(result, cov, lambda fit: abs(float(fit.x[0])))[0] == 0.0 < size
    assert interval_that_follows(result, cov, lambda fit: -abs(float(fit.x[0])))[1] == 0.0


START = InitialCondition(20.0, 0.0, 10.0, 0.005, 10.0)
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


def white(samples: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(samples)


def test_bic_by_hand() -> None:
    before, after = [1.2 * white(400, 1)], [white(400, 1)]
    n = effective_samples(after)
    assert bic_gained(before, after) == pytest.approx(n * math.log(1.44) - math.log(n))
    assert bic_gained(after, before) == pytest.approx(-math.log(n))


def test_correlated_errors_weigh_as_many_as_they_are_worth() -> None:
    after = [autoregressive(0.9, 4000, np.random.default_rng(2))]
    n = effective_samples(after)
    assert n < 800.0
    assert bic_gained([1.2 * after[0]], after) == pytest.approx(n * math.log(1.44) - math.log(n))
