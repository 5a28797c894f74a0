"""Healthy recordings give no finding, whatever their rounding, and at rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.acquisition.chain import recognise
from estimator.signals.record import OutputKind, Record
from tests.chosen import one_in
from tests.estimator.diagnosis.acquisition.bench import KINDS, PERIOD_S, SAMPLES, drive, drives, healthy

SETS = 20
"""Of three recordings each, for every rounding: 180, and 20 more at rest."""


def names(records: list[Record]) -> list[str]:
    return [finding.name for finding in recognise(records)]


@pytest.mark.parametrize("decimals", one_in(3, [3, 5, 2]))
def test_healthy_recordings_give_no_finding(decimals: int) -> None:
    alarms = {seed: found for seed in range(SETS) if (found := names(healthy(1000 + seed, decimals)))}
    assert alarms == {}


def at_rest(seed: int, noise: float, decimals: int) -> Record:
    """A reversal that begins with, and is broken by, seconds of standstill with the inverters off."""
    moving = drive("reversal", seed).record(decimals=decimals)
    rest = np.zeros(SAMPLES, dtype=bool)
    rest[:500], rest[1500:1800], rest[2000:2015] = True, True, True
    read = np.round(noise * np.random.default_rng(seed).standard_normal(SAMPLES), decimals)
    return replace(
        moving,
        output=np.where(rest, read, moving.output),
        torque_nm=np.where(rest[:, np.newaxis], 0.0, moving.torque_nm),
    )


@pytest.mark.parametrize("noise", [0.0, 0.003, 0.05])
@pytest.mark.parametrize("decimals", [3, 2])
def test_standstill_repeats_by_right(noise: float, decimals: int) -> None:
    alarms = {seed: found for seed in range(SETS // 4) if (found := names([at_rest(seed, noise, decimals)]))}
    assert alarms == {}


def without_torque_noise(seed: int) -> list[Record]:
    return [truth.record(kind, torque_noise=0.0) for kind, truth in zip(KINDS, drives(seed), strict=True)]


def without_noise(seed: int) -> list[Record]:
    return [
        truth.record(kind, noise=0.0, torque_noise=0.0, decimals=3)
        for kind, truth in zip(KINDS, drives(seed), strict=True)
    ]


def one_flagged_sample(seed: int) -> list[Record]:
    records = healthy(seed)
    okay = records[0].okay.copy()
    okay[700] = False
    return [replace(records[0], okay=okay, torque_okay=okay), *records[1:]]


def masked_by_the_model_file(seed: int) -> list[Record]:
    """Short stretches that a mask takes out, a quarter of the rows: all of it was read."""
    return [replace(record, okay=np.arange(SAMPLES) % 40 >= 10) for record in healthy(seed)]


def with_a_gap(seed: int) -> list[Record]:
    records = healthy(seed)
    okay = np.ones(SAMPLES, dtype=bool)
    okay[1000:1400] = False
    return [replace(records[0], okay=okay, output=np.where(okay, records[0].output, np.nan)), *records[1:]]


def with_a_torque_that_rests_at_zero(seed: int) -> list[Record]:
    """Inverters that are switched off now and then, long or short: the zeros are true, the motion is another's."""
    off = np.zeros(SAMPLES, dtype=bool)
    for begin in range(100, SAMPLES - 100, 150):
        off[begin : begin + 40 if begin % 300 == 100 else begin + 4] = True
    return [replace(r, torque_nm=np.where(off[:, np.newaxis], 0.0, r.torque_nm)) for r in healthy(seed)]


def with_stamps_to_the_millisecond(seed: int) -> list[Record]:
    period_s = 1.0 / 120.0
    time_s = np.round(np.arange(SAMPLES) * period_s, 3)
    return [replace(record, time_s=time_s, sample_time_s=period_s) for record in healthy(seed)]


def with_stamps_of_a_busy_host(seed: int) -> list[Record]:
    """The readings were taken on time; only the stamps are late."""
    late_s = np.random.default_rng(seed).uniform(0.0, 0.004, SAMPLES)
    return [replace(record, time_s=record.time_s + late_s) for record in healthy(seed)]


def as_positions(seed: int) -> list[Record]:
    return [
        replace(record, output=np.round(np.cumsum(record.output) * PERIOD_S, 3), kind=OutputKind.POSITION)
        for record in healthy(seed)
    ]


def with_values_between_counts(seed: int) -> list[Record]:
    """Torques counted coarsely at half the rate, every other row interpolated and rounded finely."""

    def resampled(torque: np.ndarray) -> np.ndarray:
        counts = np.round(torque[::2] / 5.0) * 5.0
        rows = np.arange(SAMPLES)
        return np.column_stack([np.round(np.interp(rows, rows[::2], count), 2) for count in counts.T])

    return [replace(record, torque_nm=resampled(record.torque_nm)) for record in healthy(seed)]


@pytest.mark.parametrize(
    "make",
    [
        without_torque_noise,
        without_noise,
        one_flagged_sample,
        masked_by_the_model_file,
        with_a_gap,
        with_a_torque_that_rests_at_zero,
        with_stamps_to_the_millisecond,
        with_stamps_of_a_busy_host,
        as_positions,
        with_values_between_counts,
    ],
)
def test_what_is_no_fault_gives_no_finding(make: Callable[[int], list[Record]]) -> None:
    alarms = {seed: found for seed in range(5) if (found := names(make(seed)))}
    assert alarms == {}


def test_a_short_recording_is_not_judged() -> None:
    short = healthy(1)[0]
    cut = replace(
        short,
        time_s=short.time_s[:30],
        torque_nm=short.torque_nm[:30],
        output=short.output[:30],
        okay=short.okay[:30],
    )
    assert recognise([cut]) == ()
