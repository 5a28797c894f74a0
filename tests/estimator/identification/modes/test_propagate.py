from __future__ import annotations

import math

import numpy as np
import pytest

from estimator.identification.modes.uncertainty import Uncertain, propagate, square_root, uncertain


def test_a_linear_function_has_its_exact_covariance() -> None:
    rng = np.random.default_rng(0)
    G, S = rng.normal(size=(2, 4)), rng.normal(size=(4, 4))
    value, covariance = propagate(lambda x: G @ x, np.arange(4.0), S @ S.T)
    np.testing.assert_allclose(value, G @ np.arange(4.0))
    np.testing.assert_allclose(covariance, G @ S @ S.T @ G.T, rtol=1e-9)


def test_a_curved_function_has_the_slope_at_the_estimate() -> None:
    _, covariance = propagate(lambda x: np.array([x[0] * x[1]]), np.array([3.0, 5.0]), np.diag([0.04, 0.09]))
    assert covariance[0, 0] == pytest.approx(25 * 0.04 + 9 * 0.09)  # d(xy) = y dx + x dy


def test_directions_without_uncertainty_are_not_stepped_along() -> None:
    def only_along_the_valley(x: np.ndarray) -> np.ndarray:
        assert x[0] + x[1] == pytest.approx(1.0)
        return x[:1]

    _, covariance = propagate(only_along_the_valley, np.array([0.5, 0.5]), np.array([[1.0, -1.0], [-1.0, 1.0]]))
    assert covariance[0, 0] == pytest.approx(1.0)


def test_rounding_below_zero_is_no_uncertainty() -> None:
    S = square_root(np.array([[1.0, 1.0 + 1e-15], [1.0 + 1e-15, 1.0]]))
    np.testing.assert_allclose(S @ S.T, np.ones((2, 2)), atol=1e-12)


def test_an_interval_of_two_standard_deviations_or_so() -> None:
    (one,) = uncertain(np.array([10.0]), np.array([[4.0]]))
    assert one.ci95 == pytest.approx((10 - 3.91993, 10 + 3.91993), abs=1e-4)
    assert one.covers(6.1)
    assert not one.covers(6.0)
    assert one.is_determined
    assert not Uncertain(3.0, 2.0).is_determined
    assert not Uncertain(3.0, math.inf).is_determined
