"""The bounded least squares against scipy's on problems with a known difficulty."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import least_squares, lsq_linear

from estimator import least_squares as bounded
from estimator.least_squares import (
    CONVERGED,
    UNDAMPED,
    Damping,
    Marquardt,
    Solution,
    TrustRegion,
    least_inside,
    least_of_quadratic,
    minimise,
)
from estimator.signals.correlation import effective_samples
from estimator.signals.record import FloatArray
from tests.estimator.diagnosis.regression import autoregressive

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


Function = Callable[[FloatArray], FloatArray]
UNBOUNDED = np.full(3, np.inf)
TIME = np.linspace(0.0, 4.0, 400)


def decay(x: FloatArray) -> FloatArray:
    return np.asarray(x[0] * np.exp(-x[1] * TIME) + x[2])


def decay_jacobian(x: FloatArray) -> FloatArray:
    fall = np.exp(-x[1] * TIME)
    return np.column_stack([fall, -x[0] * TIME * fall, np.ones_like(TIME)])


@pytest.fixture(scope="module")
def measured() -> FloatArray:
    return decay(np.array([3.0, 1.2, 0.5])) + 0.1 * np.random.default_rng(1).standard_normal(TIME.size)


def both(
    residual: Function, jacobian: Function, x0: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[Solution, FloatArray]:
    """Solve by ours and by scipy's."""
    theirs = least_squares(residual, x0, jacobian, bounds=(low, high), xtol=1e-12, ftol=1e-12, gtol=1e-12)
    return minimise(residual, jacobian, x0, low, high), np.asarray(theirs.x)


"""A Jacobian of entries up to 1 a last small step before: a tenth of a standard deviation at most, here 0.001."""


def likelihood_ratio(residual: Function, x: FloatArray, best: FloatArray) -> float:
    """n (S - S_best) / S_best: how far from the optimum in the unit that ``CONVERGED`` is in."""
    errors, least = residual(x), residual(best)
    return float(effective_samples([least]) * (errors @ errors / (least @ least) - 1.0))


@pytest.mark.parametrize(
    ("low", "high", "pressed"),
    [
        ((-np.inf, -np.inf, 0.8), (np.inf, np.inf, np.inf), 2),
        ((-np.inf, -np.inf, -np.inf), (2.0, np.inf, np.inf), 0),
        ((0.0, 2.0, 0.0), (10.0, 10.0, 10.0), 1),
    ],
)
def test_an_active_bound_is_held_and_the_rest_solved(
    measured: FloatArray, low: tuple[float, ...], high: tuple[float, ...], pressed: int
) -> None:
    def residual(x: FloatArray) -> FloatArray:
        return decay(x) - measured

    bounds = np.array(low), np.array(high)
    ours, theirs = both(residual, decay_jacobian, np.clip([2.0, 3.0, 1.0], *bounds), *bounds)
    assert ours.converged
    assert ours.x[pressed] in (low[pressed], high[pressed])
    np.testing.assert_allclose(ours.x, theirs, atol=0.01)  # what the bound leaves of the error keeps its sign for long
    assert likelihood_ratio(residual, ours.x, theirs) < CONVERGED


@pytest.mark.parametrize("x0", [(0.0, 10.0, 10.0), (0.0, 1.0, 0.5), (10.0, 1.0, 0.0), (3.0, 1.2, 10.0)])
def test_a_bound_is_left_again_when_the_optimum_lies_inside(measured: FloatArray, x0: tuple[float, ...]) -> None:
    low, high = np.array([0.0, 0.0, 0.0]), np.array([10.0, 10.0, 10.0])

    def residual(x: FloatArray) -> FloatArray:
        return decay(x) - measured

    ours, theirs = both(residual, decay_jacobian, np.array(x0), low, high)
    assert likelihood_ratio(residual, ours.x, theirs) < CONVERGED


RULES = pytest.mark.parametrize("rule", [Marquardt, TrustRegion])


@RULES
def test_rosenbrocks_valley_is_followed_to_its_end(rule: Callable[[], Damping]) -> None:
    """Zero residual at (1, 1); the classic start is (-1.2, 1)."""

    def residual(x: FloatArray) -> FloatArray:
        return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])

    def jacobian(x: FloatArray) -> FloatArray:
        return np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]])

    for box in (5.0, np.inf):
        bounds = np.full(2, -box), np.full(2, box)
        ours = minimise(residual, jacobian, np.array([-1.2, 1.0]), *bounds, damping=rule())
        np.testing.assert_allclose(ours.x, [1.0, 1.0], atol=1e-6)
        assert ours.converged


@pytest.mark.parametrize("high", [np.inf, 2.0])
def test_a_trust_region_ends_at_the_minimum_that_a_bound_leaves(measured: FloatArray, high: float) -> None:
    def residual(x: FloatArray) -> FloatArray:
        return decay(x) - measured

    low, most = -UNBOUNDED, np.array([high, np.inf, np.inf])
    start = np.array([2.0, 3.0, 1.0])
    ours = minimise(residual, decay_jacobian, start, low, most, settled=1e-9, damping=TrustRegion())
    theirs = least_squares(residual, start, decay_jacobian, (low, most), xtol=1e-12, ftol=1e-12, gtol=1e-12)
    np.testing.assert_allclose(ours.x, theirs.x, rtol=1e-4)


def test_a_step_of_a_trust_region_is_as_long_as_its_radius() -> None:
    """Also where bounds cut it short, and where a column all but depends on another."""
    rng = np.random.default_rng(3)
    J = rng.normal(size=(50, 4)) * [1.0, 1e3, 1e-3, 1.0]
    J[:, 3] = J[:, 0] + 1e-7 * J[:, 3]
    gradient, curvature, norms = J.T @ rng.normal(size=50), J.T @ J, np.linalg.norm(J, axis=0)
    for low in (-np.inf, -0.01 / norms):
        for radius in (1e-6, 1e-3, 0.1):
            region = TrustRegion(radius)
            step = region.step(np.zeros(4), gradient, curvature, np.full(4, low), np.full(4, np.inf))
            assert np.linalg.norm(norms * step) <= 1.1 * radius
            assert np.all(step >= low)
            if np.all(step > low) and region.damping > UNDAMPED:
                assert np.linalg.norm(norms * step) == pytest.approx(radius, rel=0.1)


@RULES
def test_where_no_step_helps_that_is_said(rule: Callable[[], Damping]) -> None:
    """A derivative of the wrong sign leads uphill, however short the step."""
    ours = minimise(lambda x: x + 1.0, lambda x: -np.eye(3), np.ones(3), -UNBOUNDED, UNBOUNDED, damping=rule())
    assert ours.stuck
    np.testing.assert_array_equal(ours.x, np.ones(3))


def test_near_the_end_the_derivative_is_carried_on() -> None:
    """Two decays of nearly one rate are a long valley: fewer derivatives than without, the last where it ended."""
    rates = np.array([1.0, 1.6])
    noise = 0.02 * np.random.default_rng(2).standard_normal(TIME.size)

    def falls(x: FloatArray) -> FloatArray:
        return np.exp(-np.outer(TIME, x[:2]))

    def residual(x: FloatArray) -> FloatArray:
        return np.asarray(falls(x) @ x[2:] - falls(rates) @ np.ones(2) - noise)

    def asked(smooth: bool) -> tuple[list[FloatArray], Solution]:
        points: list[FloatArray] = []

        def jacobian(x: FloatArray) -> FloatArray:
            points.append(x)
            return np.hstack([-TIME[:, None] * falls(x) * x[2:], falls(x)])

        start = np.array([0.5, 4.0, 0.3, 1.5])
        return points, minimise(residual, jacobian, start, np.zeros(4), np.full(4, 10.0), smooth=smooth)

    carried, new = asked(True)
    found, old = asked(False)
    assert len(carried) <= len(found)
    assert likelihood_ratio(residual, new.x, old.x) == pytest.approx(0.0, abs=10.0 * CONVERGED)
    for points, end in ((carried, new), (found, old)):
        assert end.converged
        assert likelihood_ratio(residual, points[-1], end.x) < 2.0 * CONVERGED


def test_a_slow_way_ends_where_the_independent_errors_can_not_tell_any_more() -> None:
    """A derivative ten times too steep makes every step a tenth of the way, and its promise all that is left."""
    rng = np.random.default_rng(4)

    def ended(error: FloatArray) -> tuple[int, float]:
        asked: list[FloatArray] = []

        def jacobian(x: FloatArray) -> FloatArray:
            asked.append(x)
            return np.full((error.size, 1), 10.0)

        low, high = np.full(1, -9.0), np.full(1, 9.0)
        ours = minimise(lambda x: x + error, jacobian, np.ones(1), low, high, 200, smooth=False)
        assert ours.converged
        best = error - error.mean()
        left = float(ours.residual @ ours.residual / (best @ best)) - 1.0
        return len(asked), effective_samples([best]) * left

    steps, left = ended(autoregressive(0.0, 4000, rng))
    fewer, left_of_correlated = ended(autoregressive(0.95, 4000, rng))
    assert max(left, left_of_correlated) < CONVERGED
    assert fewer < steps


@RULES
def test_an_unknown_without_any_influence_is_left_alone(measured: FloatArray, rule: Callable[[], Damping]) -> None:
    def residual(x: FloatArray) -> FloatArray:
        return decay(np.array([3.0, x[0], 0.5])) - measured

    def jacobian(x: FloatArray) -> FloatArray:
        return np.column_stack([decay_jacobian(np.array([3.0, x[0], 0.5]))[:, 1], np.zeros(TIME.size)])

    ours = minimise(residual, jacobian, np.array([0.5, 7.0]), -UNBOUNDED[:2], UNBOUNDED[:2], damping=rule())
    assert ours.converged
    assert ours.x[0] == pytest.approx(1.2, abs=0.05)
    assert ours.x[1] == pytest.approx(7.0, abs=1e-6)


def test_running_out_of_iterations_is_reported(measured: FloatArray) -> None:
    ours = minimise(
        lambda x: decay(x) - measured, decay_jacobian, np.array([10.0, 4.0, -2.0]), -UNBOUNDED, UNBOUNDED, iterations=1
    )
    assert not ours.converged
    assert ours.jacobian is None


@pytest.mark.parametrize("seed", range(20))
def test_correlated_unknowns_that_meet_many_bounds(seed: int) -> None:
    """Three directions carry twelve unknowns: the free step leaves the box almost everywhere."""
    rng = np.random.default_rng(seed)
    a = rng.standard_normal((60, 3)) @ rng.standard_normal((3, 12)) + 0.02 * rng.standard_normal((60, 12))
    b, box = 10.0 * rng.standard_normal(60), np.full(12, 0.5)
    ours = minimise(lambda x: a @ x - b, lambda x: a, np.zeros(12), -box, box)
    theirs = lsq_linear(a, b, (-box, box), method="bvls")
    assert ours.converged
    assert ours.residual @ ours.residual == pytest.approx(2.0 * theirs.cost, rel=CONVERGED / 60)
