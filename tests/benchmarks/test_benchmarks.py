"""The benchmarks compare like with like: fits of one minimum, simulations of one accuracy. No time is judged."""

import pytest

from estimator.physics.fit import fit
from estimator.physics.problem import Problem
from tests.benchmarks.cases import NOTHING, make
from tests.benchmarks.fit import ScipyFit, agreement, compare_simulations, fit_by_scipy, problem_of

SHORT_S = 2.0


@pytest.fixture(scope="module")
def problem() -> Problem:
    return problem_of(make(NOTHING, seed=1, duration_s=SHORT_S, tests=1))


@pytest.fixture(scope="module")
def theirs(problem: Problem) -> ScipyFit:
    return fit_by_scipy(problem)


def test_both_fits_reach_the_same_minimum(problem: Problem, theirs: ScipyFit) -> None:
    apart = agreement(fit(problem), theirs)
    assert apart.likelihood < 0.1  # of a log-likelihood ratio: no conclusion changes
    assert apart.sigmas < 0.3


def test_both_simulations_are_as_exact(problem: Problem) -> None:
    simulated = compare_simulations(problem, pairs=1)
    assert simulated.our_error < 1e-3
    assert simulated.our_error / 5.0 < simulated.their_error < 5.0 * simulated.our_error
