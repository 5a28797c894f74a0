"""Correlation lengths against the closed formula."""

import numpy as np
import pytest

from estimator.signals.correlation import correlation_length, effective_samples, stand_in_variance
from estimator.signals.record import Record
from tests.estimator.diagnosis.regression import autoregressive


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


COUNT = 20_000


def record(torque: np.ndarray, unread: slice) -> Record:
    trusted = np.ones(torque.shape, dtype=bool)
    trusted[unread, 0] = False
    time_s = 0.01 * np.arange(COUNT)
    return Record("run", 0.01, time_s, torque, time_s, np.ones(COUNT, dtype=bool), torque_okay=trusted)


@pytest.mark.parametrize("gap", [1, 3, 8])
def test_the_variance_is_that_of_a_line_drawn_over_the_gap(gap: int) -> None:
    """A random walk is a Brownian bridge between its ends: its variance in the middle is a quarter of the length."""
    walk = np.cumsum(np.random.default_rng(gap).standard_normal(COUNT))
    found = stand_in_variance(record(np.column_stack([walk, walk]), slice(50, 50 + gap)))
    half = (gap + 2) // 2
    bridge = half * (gap + 1 - half) / (gap + 1)
    np.testing.assert_allclose(found[50 : 50 + gap], bridge, rtol=0.1)
    assert np.count_nonzero(found) == gap


def test_a_gap_as_long_as_the_recording_is_bounded_by_it() -> None:
    found = stand_in_variance(record(np.linspace(0.0, 1.0, COUNT)[:, np.newaxis], slice(0, COUNT)))
    assert np.isfinite(found).all()
