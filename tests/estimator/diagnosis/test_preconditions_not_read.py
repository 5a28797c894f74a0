"""Stretches that no sensor has read are found and left out, with a warning; what a line and its sensors do stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.preconditions.channels import period_of, unwrapped
from estimator.diagnosis.preconditions.prepare import not_read, prepare, without_not_read
from estimator.physics.driveline import Start
from estimator.signals.record import FloatArray, OutputKind, Record
from tests.estimator.physics.bench import ONE_MASS, linear_record, model, random_steps

N = 3000
TIME_S = 0.01 * np.arange(N)
SEEN = np.ones(N, dtype=bool)
GAP = slice(1000, 1400)


def drive(kind: OutputKind = OutputKind.SPEED, sigma: float = 0.02) -> Record:
    return linear_record(ONE_MASS, random_steps(N, seed=1), Start(0.0, 0.0, 3.0), sigma=sigma, kind=kind)


def interpolated(values: FloatArray, gap: slice = GAP) -> FloatArray:
    filled = values.copy()
    filled[gap] = np.linspace(values[gap.start - 1], values[gap.stop], gap.stop - gap.start + 2)[1:-1]
    return filled


@pytest.mark.parametrize("digits", [4, 6, 15])
@pytest.mark.parametrize("length", [20, 400])
def test_an_interpolated_gap_is_found_and_masked(digits: int, length: int) -> None:
    gap = slice(1000, 1000 + length)
    speed = np.round(interpolated(drive().output + 0.05 * TIME_S**2, gap), digits)
    (record,), (warning,) = without_not_read([replace(drive(), output=speed)])
    assert not record.okay[gap].any()
    assert record.okay.sum() >= N - length - 4
    assert "straight lines" in warning
    assert record.name in warning


def test_a_reading_that_has_stopped_is_found_and_masked() -> None:
    speed = drive().output
    speed[GAP] = speed[GAP.start]
    (record,), (warning,) = without_not_read([replace(drive(), output=speed)])
    assert not record.okay[GAP].any()
    assert record.okay.sum() >= N - 404
    assert "stands still" in warning


def test_what_is_masked_is_a_gap_of_the_diagnosis() -> None:
    """A long one cuts the recording: each segment has an initial state and a load of its own."""
    ready = prepare([replace(drive(), output=interpolated(drive().output))], model(ONE_MASS))
    assert [record.name for record in ready.records] == ["run#1", "run#2"]
    assert any("straight lines" in warning for warning in ready.warnings)


noise = 0.02 * np.random.default_rng(3).standard_normal(N)
swing = 10.0 * np.sin(TIME_S) + 0.5 * np.sin(9.0 * TIME_S)
SOUND: dict[str, FloatArray] = {
    "a noisy drive": drive().output,
    "a drive without noise": drive(sigma=0.0).output,
    "a swing without noise": swing,
    "a swing read in coarse steps": np.round(swing),
    "a swing read in fine steps": np.round(swing, 2),
    "a ramp read in coarse steps": np.round(3.0 * TIME_S, 1),
    "a cruise read in coarse steps": np.round(50.0 + 0.3 * noise, 1),
    "at rest, and moving": np.where(TIME_S < 10.0, 0.0, swing + noise),
    "a free fall without noise": 9.81 * TIME_S,
    "settled to the last bit": 30.0 * (1.0 - np.exp(-10.0 * TIME_S)),
    "nothing": np.zeros(N),
}


@pytest.mark.parametrize("name", SOUND)
def test_what_was_read_stays(name: str) -> None:
    assert not_read("speed", SOUND[name], SEEN, may_rest=False) == []


def test_a_position_may_rest() -> None:
    position = drive(OutputKind.POSITION).output
    position[GAP] = position[GAP.start]
    assert not_read("position", position, SEEN, may_rest=True) == []
    assert not_read("speed", position, SEEN, may_rest=False) != []


@pytest.mark.parametrize("period", [2.0 * np.pi, 0.5])
def test_a_wrapped_position_is_put_together_again(period: float) -> None:
    record = drive(OutputKind.POSITION, sigma=1e-4)
    wrapped = np.mod(record.output, period) + 0.1
    (mended,), (warning,) = unwrapped([replace(record, output=wrapped)])
    offset = mended.output - record.output
    assert np.ptp(offset) < 0.02 * period
    assert record.name in warning
    if period > 1.0:
        assert np.ptp(offset) == pytest.approx(0.0, abs=1e-9)


def test_what_does_not_wrap_stays() -> None:
    position = drive(OutputKind.POSITION, sigma=1e-4).output
    lost = position.copy() + 100.0
    lost[::50] = 0.0
    off = position.copy()
    off[[500, 900]] += 5.0, 9.0
    step = position + np.where(TIME_S > 15.0, 4.0 * np.ptp(position), 0.0)
    for values in (position, lost, off, step, np.zeros(N)):
        assert period_of(values, SEEN) is None
