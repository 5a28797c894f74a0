"""Disturbances through a law that switches: intervals are wide enough there, and of a linear line as they were."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.covariance import beyond_the_line, free_unknowns, with_secants
from estimator.diagnosis.inference.descent import covariance_of_innovations
from estimator.diagnosis.inference.hypotheses import Hypothesis
from tests.estimator.diagnosis.one_effect import Bench, bench_with, searched
from tests.estimator.physics.bench import TWO_MASS

GAP = {"gap_rad": 0.02, "contact_rad": 0.001}
READ_NM = 1.0  # standard deviation of the torque's reading

SIZES = "J_M", "J_L", "k"


def fitted(name: str, values: Mapping[str, float], seed: int) -> Hypothesis:
    """Fit what was simulated to recordings whose torque is read with noise."""
    bench, rng = bench_with(name, values), np.random.default_rng(seed)
    read = [replace(r, torque_nm=r.torque_nm + READ_NM * rng.standard_normal(r.torque_nm.shape)) for r in bench.records]
    return searched(Bench(bench.model, read), (name,)).best


@pytest.fixture(scope="module")
def gaps() -> list[Hypothesis]:
    """Fits of one motion through a gap, its torque read three times."""
    return [fitted("backlash", GAP, seed) for seed in range(3)]


def spreads(of: Hypothesis) -> tuple[np.ndarray, np.ndarray]:
    """Return the standard deviations of the shared unknowns: of the likelihood at a point, and as they are drawn."""
    result = with_secants(of.result, of.filter)
    drawn = replace(of, result=result)
    added = beyond_the_line(result, of.filter, of.sizes, free_unknowns(drawn.white))
    count = len(result.problem.shared)
    along, beyond = covariance_of_innovations(of), covariance_of_innovations(drawn) + added
    return np.sqrt(np.diag(along))[:count], np.sqrt(np.diag(beyond))[:count]


def test_where_faces_meet_a_value_is_known_less_well_than_the_slope_at_a_point_says(
    gaps: list[Hypothesis],
) -> None:
    """The errors of what several readings give are as large as these intervals say; that slope's are shorter."""
    shared = gaps[0].result.problem.shared
    wanted = [[each.name for each in shared].index(name) for name in SIZES]
    true = np.array([TWO_MASS[name] / shared[i].scale for name, i in zip(SIZES, wanted, strict=True)])
    at_point, drawn = (np.array(each)[:, wanted] for each in zip(*map(spreads, gaps), strict=True))
    errors = np.array([each.result.x[wanted] for each in gaps]) - true
    assert (drawn > at_point).all()
    assert np.sqrt(np.mean(np.square(errors / drawn))) < 1.5


def test_a_linear_line_keeps_the_interval_of_the_likelihood() -> None:
    of = fitted("actuator_lag", {"time_constant_s": 0.02}, 1)
    assert with_secants(of.result, of.filter) is of.result
    added = beyond_the_line(of.result, of.filter, of.sizes, np.ones(of.result.x.size, dtype=np.bool_))
    assert not added.any()


@pytest.mark.parametrize("held", [0, 2])
def test_what_is_held_is_not_spread(gaps: list[Hypothesis], held: int) -> None:
    of = gaps[0]
    free = np.ones(of.result.x.size, dtype=np.bool_)
    free[held] = False
    added = beyond_the_line(with_secants(of.result, of.filter), of.filter, of.sizes, free)
    assert not added[held].any()
    assert not added[:, held].any()
    assert (np.diag(added)[free] >= 0.0).all()
