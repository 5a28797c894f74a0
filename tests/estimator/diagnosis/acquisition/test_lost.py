"""Lost samples: flagged, NaN, or recorded as zero; not what a mask takes out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.acquisition.chain import recognise
from estimator.diagnosis.acquisition.finding import AcquisitionFinding
from estimator.signals.record import BoolArray, Record
from tests.estimator.diagnosis.acquisition.bench import SAMPLES, healthy, random_rows


def only(records: list[Record]) -> AcquisitionFinding:
    (finding,) = recognise(records)
    assert finding.name == "lost_samples"
    return finding


def rows_of(seed: int, share: float, burst: float = 1.0) -> list[BoolArray]:
    return [random_rows(np.random.default_rng([seed, k]), share, burst) for k in range(3)]


def speed_missing(record: Record, rows: BoolArray) -> Record:
    return replace(record, okay=~rows, output=np.where(rows, np.nan, record.output))


def torque_missing(record: Record, rows: BoolArray) -> Record:
    read = np.ones(record.torque_nm.shape, dtype=bool)
    read[:, 1] = ~rows
    return replace(record, okay=~rows, torque_okay=read)


def row_flagged(record: Record, rows: BoolArray) -> Record:
    return replace(record, okay=~rows, torque_okay=~rows)


@pytest.mark.parametrize(
    ("lose", "cells"),
    [(speed_missing, [True, False, False]), (torque_missing, [False, False, True]), (row_flagged, [True, True, True])],
)
@pytest.mark.parametrize(("share", "burst"), [(0.01, 1.0), (0.05, 1.0), (0.05, 6.0)])
def test_what_the_recording_says_is_lost(lose, cells: list[bool], share: float, burst: float) -> None:
    rows = rows_of(1, share, burst)
    records = [lose(record, where) for record, where in zip(healthy(1), rows, strict=True)]
    finding = only(records)
    found = finding.parameters["share"]
    assert found.value == pytest.approx(np.mean(rows))
    assert found.ci95[0] < found.value < found.ci95[1]
    assert "missing or flagged" in finding.statement
    for record, where in zip(records, rows, strict=True):
        np.testing.assert_array_equal(finding.touched(record), where[:, None] & np.array(cells))
        np.testing.assert_array_equal(finding.rows(record), where)


@pytest.mark.parametrize("channels", [(0,), (1, 2), (0, 1, 2)])
@pytest.mark.parametrize(("share", "burst"), [(0.02, 1.0), (0.05, 4.0)])
def test_zeros_without_a_flag_are_lost(channels: tuple[int, ...], share: float, burst: float) -> None:
    rows = rows_of(3, share, burst)
    records = []
    for record, where in zip(healthy(3, 3), rows, strict=True):
        values = np.column_stack([record.output, record.torque_nm])
        values[np.ix_(where, channels)] = 0.0
        records.append(replace(record, output=values[:, 0], torque_nm=values[:, 1:]))
    finding = only(records)
    assert "recorded as zero" in finding.statement
    assert finding.parameters["share"].value == pytest.approx(np.mean(rows), rel=0.2)
    for record, where in zip(records, rows, strict=True):
        assert not finding.rows(record)[~where].any()
        assert not np.delete(finding.touched(record), channels, axis=1).any()


def test_of_a_torque_that_rests_at_zero_what_is_lost_with_the_speed_is_lost() -> None:
    """Around zero its zeros are nothing special by themselves; its own are kept."""
    rows, resting = rows_of(6, 0.02, 4.0), np.arange(SAMPLES)[:, None] % 500 < 200
    records = [
        replace(r, torque_nm=np.where(resting, 0.6 * np.round(r.torque_nm / 100.0), r.torque_nm)) for r in healthy(6)
    ]
    lost = [
        replace(r, output=np.where(where, 0.0, r.output), torque_nm=np.where(where[:, None], 0.0, r.torque_nm))
        for r, where in zip(records, rows, strict=True)
    ]
    finding = only(lost)
    for before, record, where in zip(records, lost, rows, strict=True):
        assert (before.torque_nm == 0.0).sum() > 300
        touched = finding.touched(record)
        assert touched[where & touched[:, 0]].all()
        assert not touched[~where].any()
        assert touched[where, 0].mean() > 0.9


def jumping(records: list[Record], levels_nm: list[float], noise_nm: float) -> list[Record]:
    """A torque that jumps between levels every other sample, and follows at once; read in steps of 0.6 Nm."""
    rng, jumped = np.random.default_rng(8), []
    for record in records:
        held = np.repeat(rng.choice(levels_nm, (SAMPLES + 1) // 2), 2)[:SAMPLES, None]
        read = held + noise_nm * rng.standard_normal(record.torque_nm.shape)
        jumped.append(replace(record, torque_nm=0.6 * np.round(read / 0.6)))
    return jumped


def test_of_a_torque_that_jumps_between_levels_zeros_are_lost() -> None:
    """It comes to each of its levels alone and for short as well, but with its noise: zero comes to the last digit."""
    records, rows = jumping(healthy(7), [-60.0, 13.2, 171.6, 244.2], 0.3), rows_of(7, 0.015, 5.0)
    lost = [
        replace(r, torque_nm=np.where(where[:, None] & [False, True], 0.0, r.torque_nm))
        for r, where in zip(records, rows, strict=True)
    ]
    finding = only(lost)
    for record, where in zip(lost, rows, strict=True):
        np.testing.assert_array_equal(finding.touched(record)[1:-1, 2], where[1:-1])
