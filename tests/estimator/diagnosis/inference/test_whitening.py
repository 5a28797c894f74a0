"""The filter against the covariance it stands for, written out; sizes of disturbances against those that made them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from operator import itemgetter

import numpy as np
import pytest
from scipy.linalg import block_diag, cholesky, solve_triangular

from estimator.diagnosis.inference.disturbances import (
    Limits,
    LinearLine,
    Size,
    Whitening,
    estimate,
    limits_for,
    line_of,
    readings,
    starts,
)
from estimator.diagnosis.line.line import LASTS
from estimator.physics.driveline import InitialCondition
from estimator.physics.fit import FitResult, fit
from estimator.physics.problem import make_problem
from estimator.signals.record import BoolArray, FloatArray
from tests.estimator.diagnosis.planted import drive_torque
from tests.estimator.physics.bench import SAMPLE_TIME_S, TWO_MASS, linear_record, model

second = itemgetter(1)

SIZES = np.log([0.05, 0.03, 0.04, 2.0, 1.5, 0.8, 3.0, 0.1])


@pytest.fixture(scope="module")
def result() -> FitResult:
    record = linear_record(TWO_MASS, drive_torque(1), InitialCondition(5.0, 0.0, 2.0, 0.0, 2.0))
    return fit(make_problem(model(TWO_MASS), [record], ()))


def of_one_output(line: LinearLine, uses: Sequence[BoolArray], unread: Sequence[FloatArray] | None = None) -> Whitening:
    """Return the filters of recordings of one output; all torques were read by default."""
    ends = np.cumsum([0, *(int(use.sum()) for use in uses)])
    rows = [slice(first, last) for first, last in pairwise(ends)]
    unread = [np.zeros(use.size) for use in uses] if unread is None else unread
    return Whitening(line, SAMPLE_TIME_S, [use[:, None] for use in uses], unread, rows)


def covariance(
    line: LinearLine, sizes: FloatArray, count: int, unread: FloatArray | float = 0.0, changes: FloatArray | None = None
) -> FloatArray:
    """Covariance of the error over so many samples: what each disturbance of each sample does to all later ones.

    Of several outputs in turn: shape (C count, C count). ``unread`` is the variance of the torque where it was not
    read; ``changes``, shape (3, count), by how much laws change at the motor, at the load and in the shaft.
    """
    torque, drift, drift_s, walk, share = np.exp(sizes[3:8])
    k = np.arange(count)
    apart = np.abs(k[:, None] - k[None, :]) * SAMPLE_TIME_S

    def answer(drive: FloatArray) -> FloatArray:
        """Response of each output at k to a torque held during sample j: column j."""
        pulse, x = np.zeros((count, line.h.shape[0])), drive
        for i in range(1, count):
            pulse[i], x = line.h @ x, line.f @ x
        late = k[:, None] - k[None, :]
        return np.vstack([np.where(late >= 0, each[late], 0.0) for each in pulse.T])

    at_motor, at_load = answer(line.torque), answer(line.load)
    walked = walk**2 * SAMPLE_TIME_S * np.minimum(k[:, None], k[None, :])
    torques = torque**2 * np.eye(count) + np.diag(np.broadcast_to(unread, count)) + drift**2 * np.exp(-apart / drift_s)
    noise = block_diag(
        *(
            white**2 * np.eye(count) + coloured**2 * np.exp(-apart / colour_s)
            for white, coloured, colour_s in np.exp(readings(sizes))
        )
    )
    found: FloatArray = at_motor @ torques @ at_motor.T + at_load @ walked @ at_load.T + noise
    left = np.exp(-1.0 / LASTS)  # an error of form is of first order, driven while the law changes, from a sample later
    driven = np.where(k[:, None] > k[None, :], left ** np.maximum(k[:, None] - k[None, :] - 1, 0), 0.0)
    for place, change in enumerate(np.zeros((3, count)) if changes is None else changes):
        drive = (line.torque, line.load, line.shaft)[place]
        errors = (driven * (1.0 - left**2) * (share * change) ** 2) @ driven.T
        found += answer(drive) @ errors @ answer(drive).T
    return found


def test_laws_are_off_by_a_share_of_what_they_change_by(result: FitResult) -> None:
    count = 80
    use: BoolArray = np.ones(count, dtype=bool)
    line, changes = line_of(result), np.zeros((3, count))
    changes[0, 20:25], changes[1, 40:45], changes[2, 55:70] = 30.0, 50.0, 80.0
    signals = np.random.default_rng(4).standard_normal((count, 3))
    whitening = Whitening(line, SAMPLE_TIME_S, [use[:, None]], [np.zeros(count)], [slice(0, count)], [changes])
    filtered = whitening.filters(SIZES)
    lower = cholesky(covariance(line, SIZES, count, changes=changes), lower=True)
    np.testing.assert_allclose(filtered(signals), solve_triangular(lower, signals, lower=True), rtol=2e-4, atol=1e-4)
    assert filtered.logs.sum() == pytest.approx(np.log(np.diag(lower)).sum(), abs=5e-4)


@pytest.mark.parametrize("missing", [(), (3, 4, 17), tuple(range(20, 40))])
def test_innovations_are_those_of_the_covariance_written_out(result: FitResult, missing: tuple[int, ...]) -> None:
    count = 80
    use: BoolArray = np.ones(count, dtype=bool)
    use[list(missing)] = False
    line = line_of(result)
    signals = np.random.default_rng(2).standard_normal((int(use.sum()), 3))
    unread = np.where(np.isin(np.arange(count), missing), 900.0, 0.0)
    filtered = of_one_output(line, [use], [unread]).filters(SIZES)
    lower = cholesky(covariance(line, SIZES, count, unread)[np.ix_(use, use)], lower=True)
    np.testing.assert_allclose(filtered(signals), solve_triangular(lower, signals, lower=True), rtol=2e-4, atol=1e-4)
    assert filtered.logs.sum() == pytest.approx(np.log(np.diag(lower)).sum(), abs=5e-4)


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
    whitening = of_one_output(line, uses)
    found, value = min((estimate(whitening, error, each, limits, 30) for each in begun), key=second)
    _, from_the_truth = estimate(whitening, error, true, limits, 30)
    assert value < from_the_truth + 2.0
    for size in (Size.WHITE, Size.WALK):
        assert found[size] == pytest.approx(true[size], abs=0.35)
    innovations = whitening.filters(found)(error)
    assert np.mean(innovations**2) == pytest.approx(1.0, abs=0.05)
    assert abs(innovations[1:] @ innovations[:-1]) / innovations.size < 0.05


@pytest.mark.parametrize("count", [1, 8, 11])
def test_noise_models_side_by_side_are_each_as_alone(result: FitResult, count: int) -> None:
    rng = np.random.default_rng(count)
    use: BoolArray = rng.random((300, 2)) > 0.1  # of two outputs, each with samples of its own that were not read
    use[40:60] = False
    line = line_of(result)
    line = replace(line, h=np.vstack([line.h, [0.0, 0.0, 1.0]]))
    changes = np.where(rng.random((3, 300)) > 0.9, 20.0, 0.0)
    unread = np.where(use.any(axis=1), 0.0, 400.0)
    rows = [np.arange(np.count_nonzero(use))]
    whitening = Whitening(line, SAMPLE_TIME_S, [use], [unread], rows, [changes])
    sizes = np.append(SIZES, np.log([0.1, 0.02, 0.1])) + 0.3 * rng.standard_normal((count, 11))
    error = rng.standard_normal(rows[0].size)
    found = whitening.innovations(error, sizes)
    for values, logs, each in zip(found.values, found.logs, sizes, strict=True):
        alone = whitening.filters(each)
        np.testing.assert_allclose(values, alone(error), rtol=1e-6, atol=1e-6)  # a gain that is held: `SETTLED`
        np.testing.assert_allclose(logs, alone.logs, rtol=1e-6, atol=1e-6)
