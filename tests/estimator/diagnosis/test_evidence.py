"""BIC and F test by hand, and their false alarms on regressions in which nothing is missing."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from estimator.diagnosis.noise import (
    Gain,
    gain_from_squares,
)
from estimator.signals.correlation import effective_samples
from tests.estimator.diagnosis.regression import autoregressive, regression


def white(samples: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(samples)


def test_bic_and_f_test_by_hand() -> None:
    errors = [white(400, 1)]
    n = effective_samples(errors)
    found = gain_from_squares(500.0, 400.0, added=2, unknowns=5, errors=errors)
    assert found.n_effective == n
    assert found.delta_bic == pytest.approx(n * math.log(1.25) - 2 * math.log(n))
    assert found.p_value == pytest.approx(stats.f.sf(0.25 * (n - 5) / 2, 2, n - 5))


def test_correlated_errors_weigh_as_many_as_they_are_worth() -> None:
    errors = [autoregressive(0.9, 4000, np.random.default_rng(2))]
    found = gain_from_squares(500.0, 400.0, added=1, unknowns=5, errors=errors)
    assert found.n_effective == effective_samples(errors)
    assert found.n_effective < 800.0
    assert found.delta_bic == pytest.approx(found.n_effective * math.log(1.25) - math.log(found.n_effective))


def gained(design: np.ndarray, y: np.ndarray) -> Gain:
    """What the last column of a regression gains over the first."""
    smaller, larger = (regression([columns], [y]).residual for columns in (design[:, :1], design))
    return gain_from_squares(float(smaller @ smaller), float(larger @ larger), 1, design.shape[1], [larger])


class TestFalseAlarms:
    """A regressor that has nothing to do with the output, added to a constant."""

    REPETITIONS = 400

    def p_values(self, correlation: float) -> np.ndarray:
        found = []
        for seed in range(self.REPETITIONS):
            rng = np.random.default_rng(seed)
            y, x = (autoregressive(correlation, 600, rng) for _ in range(2))
            design = np.column_stack([np.ones(600), x])
            found.append(gained(design, y).p_value)
        return np.array(found)

    @staticmethod
    def most(share: float, repetitions: int) -> int:
        """Most alarms to be expected of a test of this level, with 99.9 %."""
        return int(stats.binom.ppf(0.999, repetitions, share))

    @pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
    @pytest.mark.parametrize("level", [0.05, 0.01])
    def test_are_no_more_than_the_level(self, correlation: float, level: float) -> None:
        alarms = int(np.sum(self.p_values(correlation) < level))
        assert alarms <= self.most(level, self.REPETITIONS)

    def test_without_the_correlation_taken_into_account_they_would_be_many(self) -> None:
        """The test above can fail: with every sample counted as independent it does."""
        found = []
        for seed in range(self.REPETITIONS):
            rng = np.random.default_rng(seed)
            y, x = (autoregressive(0.9, 600, rng) for _ in range(2))
            found.append(stats.pearsonr(x, y).pvalue)
        assert np.sum(np.array(found) < 0.05) > 3 * self.most(0.05, self.REPETITIONS)
