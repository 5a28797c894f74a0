"""A descent ends where a fit of whitened errors does, and a derivative that is carried along is the one found anew."""

from __future__ import annotations

import math

import numpy as np
import pytest

from estimator.diagnosis.inference.descent import ROUGH, WHOLE, Effort, Start, descended, extended, fitted
from estimator.diagnosis.inference.disturbances import limits_of
from estimator.diagnosis.inference.hypotheses import Catalogue
from estimator.diagnosis.thresholds import Fitting
from estimator.physics.fit import FitResult, fit, not_fitted, warm_start
from estimator.physics.jacobian import jacobian_at
from estimator.physics.problem import Problem, make_problem, start_vector
from estimator.physics.unknowns import effect_unknowns, nominal_unknowns
from estimator.signals.record import FloatArray
from tests.estimator.diagnosis.one_effect import bench_with
from tests.estimator.diagnosis.planted import SIGMA

BENCH = bench_with("actuator_lag", {"time_constant_s": 0.008})


def by_noise(errors: FloatArray) -> FloatArray:
    return errors / SIGMA


def problem_with(*names: str) -> Problem:
    releases = [effect_unknowns(name, BENCH.model, BENCH.records)[0] for name in names]
    shared = [*nominal_unknowns(BENCH.model), *(each for release in releases for each in release.shared)]
    own = [tuple(each for release in releases for each in release.own[i]) for i in range(len(BENCH.records))]
    return make_problem(BENCH.model, BENCH.records, shared, own=own)


@pytest.fixture(scope="module")
def nominal() -> FitResult:
    problem = problem_with()
    return descended(not_fitted(problem, start_vector(problem)), by_noise, Effort(derivatives=6, steps=30))


def test_a_descent_ends_where_least_squares_do(nominal: FitResult) -> None:
    assert nominal.converged
    assert nominal.squares == pytest.approx(fit(problem_with()).squares, rel=1e-4)


def test_without_a_derivative_and_none_to_be_found_nothing_moves(nominal: FitResult) -> None:
    begun = not_fitted(nominal.problem, start_vector(nominal.problem))
    ended = descended(begun, by_noise, Effort(derivatives=0, steps=5))
    assert np.array_equal(ended.x, begun.x)
    assert not ended.converged


def test_only_the_columns_of_new_unknowns_are_found(nominal: FitResult) -> None:
    problem = problem_with("actuator_lag")
    begun = extended(problem, warm_start(problem, nominal), nominal)
    exact = jacobian_at(problem, begun.x, begun.outputs)
    assert begun.derivative is not None
    lag = next(i for i, each in enumerate(problem.shared) if each.name == "time_constant_s")
    assert begun.derivative[:, lag] == pytest.approx(exact[:, lag])
    assert nominal.derivative is not None
    assert begun.derivative[:, 0] == pytest.approx(nominal.derivative[:, 0])
    anew = extended(problem, begun.x, begun, anew="actuator_lag")
    assert anew.derivative is not None
    assert anew.derivative[:, lag] == pytest.approx(exact[:, lag])


def test_from_a_carried_derivative_the_effect_is_found(nominal: FitResult) -> None:
    problem = problem_with("actuator_lag")
    begun = extended(problem, warm_start(problem, nominal), nominal)
    ended = descended(begun, by_noise, Effort(derivatives=6, steps=30))
    assert ended.value("actuator_lag", "time_constant_s") == pytest.approx(0.008, rel=0.05)
    assert ended.rms == pytest.approx(SIGMA, rel=0.05)


def test_a_fit_to_its_end_is_no_less_likely_than_a_rough_one_from_the_same_start() -> None:
    problem, limits = problem_with("actuator_lag"), limits_of(BENCH.records)
    start = Start(not_fitted(problem, start_vector(problem)), limits.usual, limits)
    effects, catalogue = frozenset({"actuator_lag"}), Catalogue(BENCH.model, 1, {})
    rough, whole = (fitted(effects, start, depth, catalogue) for depth in (ROUGH, WHOLE))
    assert whole.minus_twice_log <= rough.minus_twice_log
    assert whole.result.values_of("actuator_lag")["time_constant_s"] == pytest.approx(0.008, rel=0.1)


def test_a_pass_follows_on_one_that_gained_enough() -> None:
    """Of a rough fit per sample; of one to its end in all, and the less, the nearer what it is compared with."""
    enough = Fitting.MUCH * 1000
    assert ROUGH.is_settled(100.0, 100.0 - 0.9 * enough, 1000, math.nan)
    assert not ROUGH.is_settled(100.0, 100.0 - 1.1 * enough, 1000, math.nan)
    gained = 10.0 * Fitting.SETTLED_DEVIANCE
    assert WHOLE.is_settled(100.0, 100.0 - 0.1 * gained / 2.0, 1000, math.nan)
    assert not WHOLE.is_settled(100.0, 100.0 - gained, 1000, math.nan)
    assert not WHOLE.is_settled(100.0, 100.0 - gained, 1000, rival=100.0)
    assert WHOLE.is_settled(100.0, 100.0 - gained, 1000, rival=100.0 - 2.0 * gained / Fitting.DIGITS)
