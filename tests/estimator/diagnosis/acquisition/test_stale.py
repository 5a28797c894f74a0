"""Stale samples are recognised in every channel, at random or regular intervals; innocent repeats are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.acquisition.chain import recognise
from estimator.diagnosis.acquisition.finding import OUTPUT, AcquisitionFinding
from estimator.diagnosis.acquisition.quantised import lattice_step
from estimator.diagnosis.acquisition.stale import chance_repeats
from estimator.signals.record import BoolArray, Record
from tests.estimator.diagnosis.acquisition.bench import healthy, random_rows, stale

SPEED, TORQUES, M1, M1_AND_SPEED, ROWS = (0,), (1, 2), (1,), (0, 1), (0, 1, 2)


def only(records: list[Record]) -> AcquisitionFinding:
    (finding,) = recognise(records)
    assert finding.name == "stale_samples"
    return finding


def random(seed: int, share: float, burst: float = 1.0) -> list[BoolArray]:
    return [random_rows(np.random.default_rng([seed, k]), share, burst) for k in range(3)]


def spoiled(records: list[Record], rows: list[BoolArray], channels: tuple[int, ...]) -> list[Record]:
    return [stale(record, where, channels) for record, where in zip(records, rows, strict=True)]


@pytest.mark.parametrize("channels", [SPEED, ROWS, M1_AND_SPEED])
@pytest.mark.parametrize(("share", "decimals"), [(0.02, 5), (0.05, 3), (0.02, 2), (0.3, 3)])
def test_a_stale_output_is_found_with_its_share_and_its_rows(
    channels: tuple[int, ...], share: float, decimals: int
) -> None:
    rows = random(1, share)
    records = spoiled(healthy(1, decimals), rows, channels)
    finding = only(records)
    true = float(np.mean(rows))
    found = finding.parameters["share"]
    assert found.ci95[0] <= true <= found.ci95[1]
    assert found.value == pytest.approx(true, rel=0.1)
    for record, where in zip(records, rows, strict=True):
        cells = finding.touched(record)
        assert np.mean(cells[where, OUTPUT]) > 0.99
        assert np.mean(cells[~where, OUTPUT]) < 0.02  # chance repeats at two decimals
        for i in (1, 2):
            assert np.mean(cells[where, i]) > 0.99 if i in channels else np.mean(cells[:, i]) < 0.02


@pytest.mark.parametrize("channels", [TORQUES, M1])
@pytest.mark.parametrize("share", [0.02, 0.05, 0.1, 0.2])
@pytest.mark.parametrize("seed", range(3))
def test_a_stale_torque_is_shown_by_the_speed_that_answered(channels: tuple[int, ...], share: float, seed: int) -> None:
    rows = random(seed, share)
    records = spoiled(healthy(seed), rows, channels)
    finding = only(records)
    assert finding.parameters["share"].value == pytest.approx(np.mean(rows), rel=0.5)
    cells = np.concatenate([finding.touched(record) for record in records])
    assert not cells[:, OUTPUT].any()
    assert np.mean(np.concatenate(rows)[cells[:, 1]]) > 0.9
    assert cells[:, 2].any() == (channels == TORQUES)


def test_whole_rows_are_distinguished_from_single_channels() -> None:
    rows = random(6, 0.05)
    assert "in whole rows" in only(spoiled(healthy(6), rows, ROWS)).statement
    assert "in speed and torque 1" in only(spoiled(healthy(6), rows, M1_AND_SPEED)).statement
    assert "in torque 1" in only(spoiled(healthy(6), rows, M1)).statement


def test_a_torque_recorded_a_row_late_throughout_is_a_delay_and_not_stale() -> None:
    late = [replace(record, torque_nm=np.roll(record.torque_nm, 1, axis=0)) for record in healthy(8)]
    assert recognise(late) == ()


def test_flagged_repeats_are_lost_and_not_stale() -> None:
    """The rig repeats the last value where an inverter did not answer, and says so."""
    rows = random(9, 0.05)
    records = [
        replace(record, okay=~where, torque_okay=~where)
        for record, where in zip(spoiled(healthy(9), rows, ROWS), rows, strict=True)
    ]
    assert [finding.name for finding in recognise(records)] == ["lost_samples"]


@pytest.mark.parametrize("step", [0.001, 0.01, 0.03])
def test_chance_repeats_are_predicted_from_the_other_changes(step: float) -> None:
    """White noise of 0.05 on a lattice: the estimate against the count, within four standard deviations of it."""
    values = np.round(0.05 * np.random.default_rng(1).standard_normal(200_000) / step) * step
    changes = np.diff(values)
    count = int(np.sum(np.abs(changes) < 0.5 * step))
    predicted = chance_repeats(changes, lattice_step(values))
    assert lattice_step(values) == pytest.approx(step, rel=1e-6)
    assert predicted.expected == pytest.approx(count, rel=0.1)
    assert predicted.upper > count
