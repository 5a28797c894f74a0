"""The threshold against a trial of its rule, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import chi, norm

from estimator.errors import BadSetting
from estimator.identification.tracking.alarm import false_pairs, threshold_for


@pytest.mark.parametrize(("threshold", "n"), [(1.5, 21), (2.0, 10)])
def test_probability_is_that_of_a_trial(threshold: float, n: int) -> None:
    x = np.random.default_rng(5).normal(3.0, 2.0, (200_000, n + 2))
    mean, std = x[:, :n].mean(axis=1, keepdims=True), x[:, :n].std(axis=1, ddof=1, keepdims=True)
    tau = (x[:, n:] - mean) / (std * np.sqrt(1 + 1 / n))
    pairs = (tau > threshold).all(axis=1) | (tau < -threshold).all(axis=1)
    scatter = np.sqrt(pairs.mean() / pairs.size)
    assert false_pairs(threshold, n, n - 1) == pytest.approx(pairs.mean(), abs=4 * scatter)


@pytest.mark.parametrize(("threshold", "n", "freedom"), [(0.0, 21, 20), (0.5, 21, 20), (2.5, 7, 19), (5.0, 3, 1)])
def test_probability_is_that_of_the_normal_tail_over_mean_and_spread(threshold: float, n: int, freedom: int) -> None:
    """The rule as it is stated: ``2 E[Q(h s sqrt(1 + 1/n) + m)^2]`` with m normal and nu s^2 chi-squared."""

    def given_mean(spread: float) -> float:
        beyond = threshold * spread * np.sqrt(1 + 1 / n)
        return float(norm.expect(lambda m: norm.sf(beyond + m) ** 2, scale=n**-0.5))

    expected = quad(lambda s: given_mean(s) * chi.pdf(s, freedom, scale=freedom**-0.5), 0.0, 8.0, epsabs=1e-9)[0]
    assert false_pairs(threshold, n, freedom) == pytest.approx(2 * expected, rel=1e-4)


def test_threshold_gives_the_rate_it_was_asked_for() -> None:
    threshold = threshold_for(0.1, 3600.0, 21, 20)
    assert 3600.0 * false_pairs(threshold, 21, 20) == pytest.approx(0.1, rel=1e-3)
    assert threshold_for(0.01, 3600.0, 21, 20) > threshold > threshold_for(0.1, 3600.0, 100, 99)


@pytest.mark.parametrize("rate", [0.0, -1.0, 3600.0, float("nan")])
def test_a_rate_no_threshold_has_is_refused(rate: float) -> None:
    with pytest.raises(BadSetting, match="false_alarms_per_hour"):
        threshold_for(rate, 3600.0, 21, 20)


def test_a_reference_too_short_for_the_rate_is_refused() -> None:
    with pytest.raises(BadSetting, match="longer reference"):
        threshold_for(1e-6, 3600.0, 3, 2)
