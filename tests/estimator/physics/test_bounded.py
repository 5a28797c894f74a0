"""What is least inside bounds is what scipy finds from the whole matrix."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from estimator.physics import least_squares as bounded
from estimator.physics.least_squares import least_inside, least_of_quadratic, unbounded_first

UNKNOWNS = 8
NO_BOUND = np.full(UNKNOWNS, np.inf)


@pytest.fixture
def rng(request: pytest.FixtureRequest) -> np.random.Generator:
    return np.random.default_rng(request.param)


@pytest.mark.parametrize("rng", range(20), indirect=True)
@pytest.mark.parametrize("count", [0, 1, 5, UNKNOWNS])
def test_it_is_the_least_whatever_has_bounds(rng: np.random.Generator, count: int) -> None:
    matrix, target = rng.standard_normal((30, UNKNOWNS)), 5.0 * rng.standard_normal(30)
    high = NO_BOUND.copy()
    high[UNKNOWNS - count :] = 0.1
    q, triangle = np.linalg.qr(matrix)
    x = least_inside(triangle, q.T @ target, -high, high)
    theirs = lsq_linear(matrix, target, (-high, high), method="bvls", tol=1e-14)
    assert np.all(np.abs(x) <= high)
    np.testing.assert_allclose(x, theirs.x, atol=1e-9)


@pytest.mark.parametrize("rng", range(5), indirect=True)
def test_where_pivoting_goes_round_in_circles_one_unknown_at_a_time_is_taken(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    triangle, target = np.linalg.qr(rng.standard_normal((30, UNKNOWNS)))[1], 5.0 * rng.standard_normal(UNKNOWNS)
    inside = np.full(UNKNOWNS, 0.1)
    pivoted = least_inside(triangle, target, -inside, inside)
    monkeypatch.setattr(bounded, "EXCHANGES", 0)
    np.testing.assert_allclose(least_inside(triangle, target, -inside, inside), pivoted, atol=1e-9)


def test_where_the_free_least_lies_inside_it_is_that() -> None:
    rng = np.random.default_rng(3)
    triangle, target = np.triu(rng.standard_normal((4, 4))) + 3.0 * np.eye(4), rng.standard_normal(4)
    x = least_inside(triangle, target, np.full(4, -9.0), np.full(4, 9.0))
    np.testing.assert_allclose(triangle @ x, target, atol=1e-12)


@pytest.mark.parametrize("rng", range(5), indirect=True)
@pytest.mark.parametrize("count", [0, 3, UNKNOWNS])
def test_of_a_quadratic_it_is_that_of_its_factor(rng: np.random.Generator, count: int) -> None:
    matrix, gradient = rng.standard_normal((30, UNKNOWNS)), 20.0 * rng.standard_normal(UNKNOWNS)
    high = NO_BOUND.copy()
    high[UNKNOWNS - count :] = 0.1
    x = least_of_quadratic(matrix.T @ matrix, gradient, -high, high)
    target = np.linalg.lstsq(matrix.T, -gradient, rcond=None)[
        0
    ]  # |matrix x - target|^2 is the quadratic and a constant
    theirs = lsq_linear(matrix, target, (-high, high), method="bvls", tol=1e-14)
    np.testing.assert_allclose(x, theirs.x, atol=1e-9)


def test_a_bound_of_no_room_holds_its_unknown() -> None:
    """Pressed against it from the start: the other takes what it can."""
    triangle = np.array([[1.0, 1.0], [0.0, 1.0]])
    x = least_inside(triangle, np.array([2.0, 1.0]), np.array([-np.inf, -1.0]), np.array([np.inf, 0.0]))
    np.testing.assert_allclose(x, [2.0, 0.0], atol=1e-12)


def test_unknowns_without_bounds_come_first_the_rest_in_order() -> None:
    low = np.array([0.0, -np.inf, -np.inf, -1.0, -np.inf])
    high = np.array([1.0, np.inf, 3.0, 1.0, np.inf])
    assert unbounded_first(low, high, np.ones(5, dtype=bool)).tolist() == [1, 4, 0, 2, 3]
    assert unbounded_first(low, high, np.array([True, False, True, True, True])).tolist() == [4, 0, 2, 3]


def test_unknowns_that_do_the_same_share_what_is_to_be_done() -> None:
    """Two columns alike but for rounding: their normal equations have no solution, the least has many."""
    triangle = np.array([[1.0, 1.0, 0.5], [0.0, 1e-17, 0.0], [0.0, 0.0, 1.0]])
    target, high = np.array([1.5, 0.0, 4.0]), np.array([0.9, 0.9, 2.0])
    x = least_inside(triangle, target, -high, high)
    assert np.all(np.abs(x) <= high)
    np.testing.assert_allclose([x[0] + x[1], x[2]], [0.5, 2.0], atol=1e-9)
