"""Compensated records: wrong readings masked, torques filled by their clock or estimated from a fit."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from estimator.diagnosis.acquisition import OUTPUT, Misfit, as_read, compensate, recognise, repaired
from estimator.diagnosis.acquisition.holding import clock_of, fill
from estimator.errors import BadShape
from estimator.signals.record import BoolArray, FloatArray, Record
from tests.estimator.diagnosis.acquisition.bench import (
    KINDS,
    NOISE,
    SAMPLES,
    TORQUE_NOISE,
    Truth,
    drive,
    drives,
    prbs,
    random_rows,
    repeating,
    stale,
)

ROWS = (0, 1, 2)


def simulated(truth: Truth, record: Record) -> FloatArray:
    return truth.line.speed(record.total_torque_nm, truth.start)


def error_rms(truth: Truth, record: Record) -> float:
    return float(np.std((simulated(truth, record) - record.output)[record.okay]))


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


def lost(truth: Truth, kind: str, rows: BoolArray) -> Record:
    """A recording in which rows were lost and the last torque is held."""
    record = truth.record(kind)
    torque = np.column_stack([repeating(torque, rows) for torque in record.torque_nm.T])
    return replace(record, torque_nm=torque, okay=~rows, torque_okay=~rows)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("share", "burst"), [(0.1, 1.0), (0.02, 3.0), (0.08, 3.0)])
def test_unknown_torques_are_estimated_from_the_error(kind: str, share: float, burst: float) -> None:
    truth, rows = drive(kind, 3), random_rows(np.random.default_rng(1), share, burst)
    held = lost(truth, kind, rows)
    (filled,) = compensate([held], recognise([held]))
    misfits = [Misfit(simulated(truth, r) - r.output, truth.line.pulse()) for r in (held, filled)]
    mended, both = repaired([held, filled], misfits)
    assert error_rms(truth, held) > 2.0 * NOISE
    assert error_rms(truth, mended) < 1.4 * NOISE
    assert error_rms(truth, both) < 1.15 * NOISE
    assert torque_error(truth, mended, rows) < 0.5 * torque_error(truth, held, rows)
    assert torque_error(truth, both, rows) < 0.5 * torque_error(truth, held, rows)
    np.testing.assert_array_equal(both.torque_nm[~rows], held.torque_nm[~rows])
    np.testing.assert_array_equal(both.torque_trusted, filled.torque_trusted)


def test_one_inverter_alone_is_corrected() -> None:
    truth, rows = drive("cruise", 4), random_rows(np.random.default_rng(1), 0.05)
    record = truth.record()
    read = np.column_stack([~rows, np.ones(SAMPLES, dtype=bool)])
    torque = np.column_stack([repeating(record.torque_nm[:, 0], rows), record.torque_nm[:, 1]])
    held = replace(record, torque_nm=torque, torque_okay=read)
    (mended,) = repaired([held], [Misfit(simulated(truth, held) - held.output, truth.line.pulse())])
    np.testing.assert_array_equal(mended.torque_nm[:, 1], held.torque_nm[:, 1])
    assert torque_error(truth, mended, rows) < 0.3 * torque_error(truth, held, rows)


@pytest.mark.parametrize("rows", [np.arange(SAMPLES) % 3 == 1, (np.arange(SAMPLES) > 500) & (np.arange(SAMPLES) < 700)])
def test_too_many_unknown_torques_stay_as_they_are(rows: BoolArray) -> None:
    truth = drive("cruise", 1)
    held = lost(truth, "cruise", rows)
    (same,) = repaired([held], [Misfit(simulated(truth, held) - held.output, truth.line.pulse())])
    assert same is held


def test_repairing_300_rows_of_3000_is_fast() -> None:
    truth, rows = drive("cruise", 1), np.arange(SAMPLES) % 10 == 5
    held = lost(truth, "cruise", rows)
    misfit = Misfit(simulated(truth, held) - held.output, truth.line.pulse())
    took = []
    for _ in range(5):
        begin = time.process_time()
        repaired([held], [misfit])
        took.append(time.process_time() - begin)
    assert min(took) < 0.2


def test_an_error_of_the_wrong_shape_is_refused() -> None:
    truth = drive("cruise", 1)
    record = truth.record()
    for error in (np.zeros(5), np.full(SAMPLES, np.nan)):
        with pytest.raises(BadShape, match="recording run: expected an error of shape"):
            repaired([record], [Misfit(error, truth.line.pulse())])


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


def test_without_a_clock_a_torque_is_interpolated_and_unknown() -> None:
    torque = np.array([0.0, 1.0, 99.0, 99.0, 4.0, 5.0])
    filled, known = fill(torque, torque < 50.0)
    np.testing.assert_allclose(filled, np.arange(6.0))
    np.testing.assert_array_equal(known, torque < 50.0)


def test_a_torque_is_held_at_the_ends() -> None:
    filled, known = fill(np.array([99.0, 1.0, 2.0, 99.0]), np.array([False, True, True, False]))
    assert filled.tolist() == [1.0, 1.0, 2.0, 2.0]
    assert known.tolist() == [False, True, True, False]


def test_a_step_of_another_size_is_not_the_clocks() -> None:
    rng = np.random.default_rng(1)
    torque = prbs(rng, 60.0, 3) + np.where(np.arange(SAMPLES) < 1501, 0.0, 400.0)
    torque += TORQUE_NOISE * rng.standard_normal(SAMPLES)
    trusted = np.arange(SAMPLES) != 1501
    assert not fill(torque, trusted)[1][1501]
    assert fill(torque, np.arange(SAMPLES) != 1201)[1][1201]


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


def test_one_that_follows_something_else_is_interpolated() -> None:
    rng = np.random.default_rng(5)
    _, torque = commanded(rng)
    trusted = ~random_rows(rng, 0.1, 4.0)
    filled, known = fill(torque, trusted, 100.0 * rng.standard_normal(SAMPLES))
    np.testing.assert_array_equal(known, trusted)
    np.testing.assert_array_equal(filled, fill(torque, trusted)[0])


@pytest.mark.parametrize("kind", KINDS)
def test_a_simulation_is_shown_as_the_recording_would_show_it(kind: str) -> None:
    truth, rows = drive(kind, 6), random_rows(np.random.default_rng(3), 0.1)
    raw = stale(truth.record(kind), rows, ROWS)
    shown = as_read(truth.speed(), raw, {"stale_samples": {"share": 0.1}})
    assert np.std(shown - raw.output) < 1.1 * NOISE
    assert np.std(truth.speed() - raw.output) > 2.0 * NOISE
    np.testing.assert_array_equal(as_read(truth.speed(), raw, {"lost_samples": {"share": 0.1}}), truth.speed())


def test_a_simulation_is_rounded_to_the_sensor_s_steps() -> None:
    (truth, *_) = drives(1)
    record = truth.record()
    shown = as_read(np.array([0.9, 1.1, -1.6]), record, {"speed_quantisation": {"step_rad_s": 0.5}})
    assert shown.tolist() == [1.0, 1.0, -1.5]
