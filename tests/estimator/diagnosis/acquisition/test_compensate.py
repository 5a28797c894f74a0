"""Compensated records: wrong readings masked, torques filled by their clock."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from estimator.diagnosis.acquisition.chain import as_read, clock_of, compensate, fill, recognise
from estimator.diagnosis.acquisition.finding import OUTPUT
from estimator.signals.record import BoolArray, FloatArray, Record
from tests.estimator.diagnosis.acquisition.bench import (
    KINDS,
    NOISE,
    SAMPLES,
    TORQUE_NOISE,
    Truth,
    drive,
    prbs,
    random_rows,
    stale,
)

ROWS = (0, 1, 2)


def torque_error(truth: Truth, record: Record, rows: BoolArray) -> float:
    return float(np.sqrt(np.mean((record.total_torque_nm - truth.torque)[rows] ** 2)))


@pytest.mark.parametrize("kind", KINDS)
def test_stale_rows_are_masked_and_their_torque_known_by_its_clock(kind: str) -> None:
    truth, rows = drive(kind, 5), random_rows(np.random.default_rng(2), 0.08)
    raw = stale(truth.record(kind), rows, ROWS)
    findings = recognise([raw])
    (record,) = compensate([raw], findings)
    np.testing.assert_array_equal(record.okay, ~findings[0].touched(raw)[:, OUTPUT])
    known = record.torque_trusted.all(axis=1)
    assert known[rows].mean() > 0.9
    assert torque_error(truth, record, rows & known) < 5.0 * TORQUE_NOISE
    assert torque_error(truth, raw, rows) > 20.0


@pytest.mark.parametrize("hold", [2, 3, 7])
def test_the_clock_of_a_torque_is_found(hold: int) -> None:
    rng = np.random.default_rng(hold)
    torque = np.roll(prbs(rng, 60.0, hold), 1) + TORQUE_NOISE * rng.standard_normal(SAMPLES)
    clock = clock_of(torque, np.ones(SAMPLES, dtype=bool))
    assert clock is not None
    assert (clock.period, clock.phase) == (hold, 1)
    assert clock.step_nm == pytest.approx(120.0, rel=0.02)


def test_a_smooth_torque_and_one_that_steps_at_any_row_have_no_clock() -> None:
    rng, every = np.random.default_rng(1), np.ones(SAMPLES, dtype=bool)
    assert clock_of(np.cumsum(rng.standard_normal(SAMPLES)), every) is None
    assert clock_of(prbs(rng, 60.0, 1), every) is None
    assert clock_of(prbs(rng, 60.0, 2), ~every) is None


def commanded(rng: np.random.Generator, noise: float = TORQUE_NOISE, lag: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """A reference that steps at any row, and a drive's share of it: with an offset, noise and a lag."""
    reference = 200.0 + 40.0 * np.sin(np.arange(SAMPLES) / 300.0) + prbs(rng, 60.0, 1)
    answer = lfilter([1.0 - lag], [1.0, -lag], 0.6 * reference) + 3.0
    return reference, answer + noise * rng.standard_normal(SAMPLES)


@pytest.mark.parametrize("lag", [0.0, 0.2])
def test_a_torque_that_follows_a_reference_is_known_by_it(lag: float) -> None:
    rng = np.random.default_rng(5)
    reference, torque = commanded(rng, lag=lag)
    trusted = ~random_rows(rng, 0.1, 4.0)
    filled, known = fill(np.where(trusted, torque, 0.0), trusted, reference)
    assert known.all()
    np.testing.assert_array_equal(filled[trusted], torque[trusted])
    assert np.std((filled - torque)[~trusted]) < 2.5 * TORQUE_NOISE
    assert np.std((fill(torque, trusted)[0] - torque)[~trusted]) > 20.0


def test_one_that_follows_roughly_is_filled_by_it_and_unknown() -> None:
    """A drive with a slow lag: three references tell most of it, and more than the noise is left."""
    rng = np.random.default_rng(5)
    reference, torque = commanded(rng, lag=0.7)
    trusted = ~random_rows(rng, 0.1, 4.0)
    filled, known = fill(torque, trusted, reference)
    np.testing.assert_array_equal(known, trusted)
    assert np.std((filled - torque)[~trusted]) < 0.6 * np.std((fill(torque, trusted)[0] - torque)[~trusted])


@pytest.mark.parametrize("gone", [np.nan, 0.0])
def test_a_reference_that_was_lost_with_the_torque_tells_nothing(gone: float) -> None:
    rng = np.random.default_rng(5)
    reference, torque = commanded(rng)
    trusted = ~random_rows(rng, 0.1, 4.0)
    filled, known = fill(torque, trusted, np.where(trusted, reference, gone))
    plain, _ = fill(torque, trusted)
    np.testing.assert_array_equal(known, trusted)
    np.testing.assert_array_equal(filled, plain)


@pytest.mark.parametrize("kind", KINDS)
def test_a_simulation_is_shown_as_the_recording_would_show_it(kind: str) -> None:
    truth, rows = drive(kind, 6), random_rows(np.random.default_rng(3), 0.1)
    raw = stale(truth.record(kind), rows, ROWS)
    shown = as_read(truth.speed(), raw, {"stale_samples": {"share": 0.1}})
    assert np.std(shown - raw.output) < 1.1 * NOISE
    assert np.std(truth.speed() - raw.output) > 2.0 * NOISE
    np.testing.assert_array_equal(as_read(truth.speed(), raw, {"lost_samples": {"share": 0.1}}), truth.speed())
