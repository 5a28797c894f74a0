"""The filter against the covariance it stands for, written out; sizes of disturbances against those that made them."""

from __future__ import annotations

from operator import itemgetter

import numpy as np
import pytest
from scipy.linalg import block_diag, cholesky, solve_triangular

from estimator.diagnosis.inference.disturbances import (
    Limits,
    Line,
    Size,
    estimate,
    limits_for,
    line_of,
    starts,
    whitener,
)
from estimator.physics.fit import FitResult, fit
from estimator.physics.problem import make_problem
from estimator.physics.start import Start
from estimator.signals.record import BoolArray, FloatArray
from tests.estimator.diagnosis.planted import drive_torque
from tests.estimator.physics.bench import SAMPLE_TIME_S, TWO_MASS, linear_record, model

second = itemgetter(1)

SIZES = np.log([0.05, 0.03, 0.04, 2.0, 1.5, 0.8, 3.0])


@pytest.fixture(scope="module")
def result() -> FitResult:
    record = linear_record(TWO_MASS, drive_torque(1), Start(5.0, 0.0, 2.0, 0.0, 2.0))
    return fit(make_problem(model(TWO_MASS), [record], ()))


def covariance(line: Line, sizes: FloatArray, count: int, unread: FloatArray | float = 0.0) -> FloatArray:
    """Covariance of the error over so many samples: what each disturbance of each sample does to all later ones.

    ``unread`` is the variance of the torque where it was not read.
    """
    white, coloured, colour_s, torque, drift, drift_s, walk = np.exp(sizes)
    k = np.arange(count)
    apart = np.abs(k[:, None] - k[None, :]) * SAMPLE_TIME_S

    def answer(drive: FloatArray) -> FloatArray:
        """Response of the output at k to a torque held during sample j: column j."""
        pulse, x = np.zeros(count), drive
        for i in range(1, count):
            pulse[i], x = line.h @ x, line.f @ x
        return np.array([[pulse[i - j] if i >= j else 0.0 for j in range(count)] for i in range(count)])

    at_motor, at_load = answer(line.torque), answer(line.load)
    walked = walk**2 * SAMPLE_TIME_S * np.minimum(k[:, None], k[None, :])
    torques = torque**2 * np.eye(count) + np.diag(np.broadcast_to(unread, count)) + drift**2 * np.exp(-apart / drift_s)
    readings = white**2 * np.eye(count) + coloured**2 * np.exp(-apart / colour_s)
    found: FloatArray = at_motor @ torques @ at_motor.T + at_load @ walked @ at_load.T + readings
    return found


@pytest.mark.parametrize("missing", [(), (3, 4, 17), tuple(range(20, 40))])
def test_innovations_are_those_of_the_covariance_written_out(result: FitResult, missing: tuple[int, ...]) -> None:
    count = 80
    use: BoolArray = np.ones(count, dtype=bool)
    use[list(missing)] = False
    line = line_of(result)
    signals = np.random.default_rng(2).standard_normal((int(use.sum()), 3))
    unread = np.where(np.isin(np.arange(count), missing), 900.0, 0.0)
    filtered = whitener(line, SIZES, SAMPLE_TIME_S, [use], [unread])
    lower = cholesky(covariance(line, SIZES, count, unread)[np.ix_(use, use)], lower=True)
    np.testing.assert_allclose(filtered(signals), solve_triangular(lower, signals, lower=True), rtol=2e-4, atol=1e-4)
    spread = np.concatenate([each[rows] for each, rows in zip(filtered.spread, filtered.use, strict=True)])
    assert np.log(spread).sum() == pytest.approx(np.log(np.diag(lower)).sum(), abs=5e-4)


def test_recordings_are_whitened_each_by_itself(result: FitResult) -> None:
    uses = [np.ones(30, dtype=bool), np.ones(50, dtype=bool)]
    stacked = np.random.default_rng(3).standard_normal(80)
    line = line_of(result)
    whole = whitener(line, SIZES, SAMPLE_TIME_S, uses)(stacked)
    dense = cholesky(block_diag(*(covariance(line, SIZES, use.size) for use in uses)), lower=True)
    np.testing.assert_allclose(whole, solve_triangular(dense, stacked, lower=True), rtol=2e-4, atol=1e-4)


@pytest.mark.parametrize("seed", range(3))
def test_the_sizes_that_made_an_error_are_found(result: FitResult, seed: int) -> None:
    count = 700
    true = SIZES.copy()
    true[Size.WALK] = np.log(15.0)
    line = line_of(result)
    lower = cholesky(covariance(line, true, count), lower=True)
    rng = np.random.default_rng(seed)
    uses = [np.ones(count, dtype=bool)] * 6
    error = np.concatenate([lower @ rng.standard_normal(count) for _ in uses])
    limits = limits_for(result.problem.records, 0.05)
    limits = Limits(limits.usual, limits.low, limits.high + np.log(100.0))
    begun = starts(limits.usual, limits)
    found, value = min((estimate(line, error, each, limits, SAMPLE_TIME_S, uses, 30) for each in begun), key=second)
    _, from_the_truth = estimate(line, error, true, limits, SAMPLE_TIME_S, uses, rounds=30)
    assert value < from_the_truth + 2.0
    for size in (Size.WHITE, Size.WALK):
        assert found[size] == pytest.approx(true[size], abs=0.35)
    innovations = whitener(line, found, SAMPLE_TIME_S, uses)(error)
    assert np.mean(innovations**2) == pytest.approx(1.0, abs=0.05)
    assert abs(innovations[1:] @ innovations[:-1]) / innovations.size < 0.05
