"""Jitter of the samples: shown by stamps and confirmed by the output, or hidden and seen in the errors alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.acquisition.chain import compensate, recognise
from estimator.diagnosis.acquisition.finding import OUTPUT, AcquisitionFinding
from estimator.diagnosis.acquisition.jitter import hidden_jitter
from estimator.signals.record import FloatArray, Record
from tests.estimator.diagnosis.acquisition.bench import (
    KINDS,
    SAMPLES,
    Truth,
    drives,
    random_rows,
    repeating,
)


def offsets(seed: int, jitter_s: float, gaussian: bool = True) -> FloatArray:
    """Offsets of the given rms, within half a period and not before the start."""
    rng = np.random.default_rng(seed)
    drawn = rng.standard_normal(SAMPLES) if gaussian else np.sqrt(3.0) * rng.uniform(-1.0, 1.0, SAMPLES)
    offset = np.clip(jitter_s * drawn, -0.0049, 0.0049)
    offset[0] = abs(offset[0])
    return offset


def stamped(seed: int, jitter_s: float, decimals: int = 6) -> list[Record]:
    found = []
    for kind, truth in zip(KINDS, drives(seed), strict=True):
        offset = offsets(seed, jitter_s)
        record = truth.record(kind, speed=truth.speed(offset))
        found.append(replace(record, time_s=np.round(record.time_s + offset, decimals)))
    return found


@pytest.mark.parametrize("jitter_s", [0.0003, 0.001, 0.0015])
@pytest.mark.parametrize("seed", range(3))
def test_stamps_tell_and_are_compensated(jitter_s: float, seed: int) -> None:
    records = stamped(seed, jitter_s)
    findings = recognise(records)
    assert [finding.name for finding in findings] == ["sample_jitter"]
    true = float(np.std(offsets(seed, jitter_s)))
    value, ci95, unit = findings[0].parameters["jitter_s"]
    assert value == pytest.approx(true, rel=0.02)
    assert ci95[0] <= value <= ci95[1]
    assert unit == "s"
    for record in compensate(records, findings):
        assert record.offset_s is not None
        drawn = offsets(seed, jitter_s)
        np.testing.assert_allclose(record.offset_s, drawn - drawn.mean(), atol=1e-5)  # no stamp tells of the mean
        np.testing.assert_allclose(np.diff(record.time_s), record.sample_time_s, rtol=1e-3)


def slopes_of(truth: Truth) -> FloatArray:
    """Before and after each sample; before the first there is nothing."""
    h = 1e-4
    now = truth.speed()
    after = (truth.speed(np.full(SAMPLES, h)) - now) / h
    early = np.where(np.arange(SAMPLES) > 0, -h, 0.0)
    return np.stack([np.where(early < 0.0, (now - truth.speed(early)) / h, after), after])


def seen(seed: int, jitter_s: float, gaussian: bool = True, **mistaken: float) -> AcquisitionFinding | None:
    """Judge the errors of a line that differs by the given factors, a slow drift taken off as a fit would."""
    records, errors, slopes = [], [], []
    drift = np.vander(np.linspace(-1.0, 1.0, SAMPLES), 5)
    for kind, truth in zip(KINDS, drives(seed), strict=True):
        record = truth.record(kind, speed=truth.speed(offsets(seed, jitter_s, gaussian)))
        line = replace(truth.line, **{name: factor * getattr(truth.line, name) for name, factor in mistaken.items()})
        error = record.output - line.speed(truth.torque, truth.start)
        errors.append(error - drift @ np.linalg.lstsq(drift, error, rcond=None)[0])
        slopes.append(slopes_of(truth))
        records.append(record)
    return hidden_jitter(records, errors, slopes, [record.okay for record in records])


@pytest.mark.parametrize("gaussian", [True, False])
@pytest.mark.parametrize("jitter_s", [0.0005, 0.001, 0.002])
@pytest.mark.parametrize("seed", range(3))
def test_hidden_jitter_is_seen_and_sized(jitter_s: float, gaussian: bool, seed: int) -> None:
    finding = seen(seed, jitter_s, gaussian)
    assert finding is not None
    true = float(np.std(offsets(seed, jitter_s, gaussian)))
    value, ci95, _ = finding.parameters["jitter_s"]
    assert value == pytest.approx(true, rel=0.05)
    assert ci95[0] < value < ci95[1] < 1.1 * value
    assert finding.cells["cruise"][:, OUTPUT].all()
    assert not finding.cells["cruise"][:, 1:].any()


@pytest.mark.parametrize("seed", range(20))
def test_noise_alone_is_no_jitter(seed: int) -> None:
    assert seen(seed, 0.0) is None


@pytest.mark.parametrize("mistaken", [{"k": 1.02}, {"k": 1.1}, {"j_m": 1.05}, {"c": 2.0}, {"b_m": 2.0}])
@pytest.mark.parametrize("seed", range(4))
def test_a_mistaken_line_is_no_jitter(mistaken: dict[str, float], seed: int) -> None:
    assert seen(seed, 0.0, **mistaken) is None


def test_a_few_wild_rows_are_no_jitter() -> None:
    """Stale rows that nobody masked: the error follows the slope in those rows alone."""
    records, errors, slopes = [], [], []
    for k, (kind, truth) in enumerate(zip(KINDS, drives(1), strict=True)):
        record = truth.record(kind)
        read = repeating(record.output, random_rows(np.random.default_rng(k), 0.03))
        records.append(record)
        errors.append(read - truth.speed())
        slopes.append(slopes_of(truth))
    assert hidden_jitter(records, errors, slopes, [record.okay for record in records]) is None
