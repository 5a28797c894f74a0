"""The benchmarks compare like with like: fits of one minimum, simulations of one accuracy. No time is judged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from estimator.physics.fit import fit
from estimator.physics.problem import Problem
from tests.benchmarks.cases import NOTHING, make
from tests.benchmarks.fit import ScipyFit, agreement, compare_simulations, fit_by_scipy, problem_of
from tests.benchmarks.memory import read_case, write_case
from tests.benchmarks.ratios import Comparison, Taken

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


def test_fits_of_other_recordings_do_not_agree(theirs: ScipyFit) -> None:
    other = problem_of(make(NOTHING, seed=2, duration_s=SHORT_S, tests=1))
    apart = agreement(fit(other), theirs)
    assert apart.likelihood > 1.0
    assert apart.sigmas > 1.0


def test_a_ratio_is_of_medians_and_reported_pair_by_pair() -> None:
    ours, theirs = (tuple(Taken(2.0 * s, s) for s in side) for side in ((1.0, 2.0, 4.0), (10.0, 40.0, 20.0)))
    seen = Comparison(ours, theirs, None, None)
    assert (seen.ratio, seen.processor_ratio) == (10.0, 10.0)
    assert seen.spread == (5.0, 20.0)


def test_a_longer_or_faster_recording_is_of_the_same_drive() -> None:
    short, long, fast = (make("backlash", 3, *how).records for how in ((2.0,), (4.0,), (2.0, 4)))
    assert [record.time_s.size for record in (short[0], long[0], fast[0])] == [200, 400, 800]
    assert fast[1].sample_time_s == pytest.approx(0.0025)
    for few, more, read in zip(short, long, fast, strict=True):
        assert np.abs(few.output - more.output[:200]).max() < 0.5
        assert np.abs(few.output - read.output[::4]).max() < 0.5  # ten times the noise of a reading


def test_another_process_gets_the_same_recordings(tmp_path: Path) -> None:
    case = make(NOTHING, seed=1, duration_s=1.0)
    write_case(tmp_path / "case.npz", case)
    again = read_case(tmp_path / "case.npz")
    assert again.model.parameters == case.model.parameters
    for before, after in zip(case.records, again.records, strict=True):
        assert np.array_equal(before.output, after.output)
        assert np.array_equal(before.torque_nm, after.torque_nm)
        assert after.sample_time_s == pytest.approx(before.sample_time_s)
