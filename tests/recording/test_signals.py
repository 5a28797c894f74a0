"""From columns to the estimator's Record: roles, scales, masks, held torque, time base."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from estimator.signals.record import Location, OutputKind
from hil.errors import InputError, RecordingError, UsageError
from hil.recording import SignalsConfig, Table, read_record, read_records, write_table
from hil.recording.signals import to_record

Changed = Callable[..., Table]


def signals(**keys: Any) -> SignalsConfig:
    return SignalsConfig.model_validate(keys)


def test_own_columns_are_two_inputs_and_the_motor_speed(own_table: Table) -> None:
    record = to_record(own_table, SignalsConfig())
    assert (record.name, record.sample_time_s) == ("run_1", 0.01)
    assert (record.kind, record.location) == (OutputKind.SPEED, Location.MOTOR)
    np.testing.assert_array_equal(record.torque_nm[:, 0], own_table.columns["torque_m1_nm"])
    np.testing.assert_array_equal(record.torque_nm[:, 1], own_table.columns["torque_m2_nm"])
    np.testing.assert_array_equal(record.output, own_table.columns["speed_rad_s"])
    assert record.okay.all()


@pytest.mark.parametrize("kind", [OutputKind.SPEED, OutputKind.POSITION, OutputKind.FORCE])
@pytest.mark.parametrize("at", list(Location))
def test_named_columns_are_scaled_into_their_roles(own_table: Table, kind: OutputKind, at: Location) -> None:
    config = signals(
        time={"column": "time_s", "scale": 2.0},
        torque=[{"column": "torque_m2_nm", "scale": -3.0}],
        **{kind.value: {"column": "torque_m1_nm", "scale": 0.5, "at": at.value}},
    )
    record = to_record(own_table, config)
    assert (record.sample_time_s, record.kind, record.location) == (0.02, kind, at)
    np.testing.assert_array_equal(record.torque_nm, -3.0 * own_table.columns["torque_m2_nm"][:, np.newaxis])
    np.testing.assert_array_equal(record.output, 0.5 * own_table.columns["torque_m1_nm"])


def test_missing_and_flagged_samples_hold_the_last_good_torque(changed: Changed) -> None:
    torque = np.arange(40.0)
    torque[[0, 1, 5, 6]] = np.nan
    flags = np.zeros(40, dtype=np.int64)
    flags[10] = 4
    speed = np.ones(40)
    speed[20] = np.nan
    record = to_record(changed(torque_m1_nm=torque, flags=flags, speed_rad_s=speed), SignalsConfig())
    expected = np.arange(40.0)
    expected[[0, 1, 5, 6, 10]] = [2, 2, 4, 4, 9]
    np.testing.assert_array_equal(record.torque_nm[:, 0], expected)
    assert np.flatnonzero(~record.okay).tolist() == [0, 1, 5, 6, 10, 20]
    assert np.flatnonzero(~record.torque_trusted[:, 0]).tolist() == [0, 1, 5, 6, 10]
    assert np.flatnonzero(~record.torque_trusted[:, 1]).tolist() == [10]


def test_the_reference_is_taken_along_where_a_recording_of_the_rig_has_it(changed: Changed) -> None:
    reference = np.where(np.arange(40) == 7, np.nan, np.arange(40.0))
    table = changed(torque_ref_nm=reference)
    np.testing.assert_array_equal(to_record(table, SignalsConfig()).reference_nm, reference)
    assert to_record(table, signals(torque=[{"column": "torque_m1_nm"}])).reference_nm is None
    assert to_record(changed(torque_ref_nm=None), SignalsConfig()).reference_nm is None


def test_a_mask_takes_rows_out_and_keeps_their_torque(changed: Changed, own_table: Table) -> None:
    throttle = np.full(40, 50.0)
    throttle[7:12] = 1.0
    throttle[30] = np.nan
    record = to_record(changed(throttle=throttle), signals(mask=[{"column": "throttle", "min": 2.0}]))
    assert np.flatnonzero(~record.okay).tolist() == [7, 8, 9, 10, 11, 30]
    assert record.torque_okay is None
    np.testing.assert_array_equal(record.torque_nm[:, 0], own_table.columns["torque_m1_nm"])


def with_time(changed: Changed, time_s: np.ndarray) -> Table:
    table = changed(time_s=time_s)
    return Table(table.path, table.columns, first_line=2)


@pytest.mark.parametrize(
    ("row", "value", "said"),
    [
        (5, 0.04, "line 7, column time_s: expected a time greater than in the row before"),
        (
            5,
            0.0,
            "line 7, column time_s: expected a time greater than in the row before, got 0 s after 0.04 s",
        ),
        (5, np.nan, "line 7, column time_s: expected a time greater than in the row before, got nan s"),
        (39, 0.41, "line 41, column time_s: expected a uniform step of 0.01 s within 50%"),
    ],
)
def test_a_time_that_does_not_continue_evenly_is_refused_by_line(
    changed: Changed, row: int, value: float, said: str
) -> None:
    time_s = np.arange(40) * 0.01
    time_s[row] = value
    with pytest.raises(RecordingError) as refusal:
        to_record(with_time(changed, time_s), SignalsConfig())
    assert said in str(refusal.value)


def test_a_rate_that_changes_is_refused(tmp_path: Path) -> None:
    steps = np.concatenate([np.full(500, 0.01), np.full(300, 0.012)])
    n = steps.size
    table = Table(
        tmp_path / "run.csv",
        {name: np.ones(n) for name in ("torque_m1_nm", "torque_m2_nm", "speed_rad_s")} | {"time_s": np.cumsum(steps)},
    )
    with pytest.raises(RecordingError, match=r"expected a constant rate, a mean step of 0\.01 s over 100 rows"):
        to_record(table, SignalsConfig())


@pytest.fixture
def three_runs(tmp_path: Path, own_table: Table) -> list[Path]:
    paths = [tmp_path / f"run_{k}.csv" for k in range(3)]
    for k, path in enumerate(paths):
        columns = {**own_table.columns, "speed_rad_s": own_table.columns["speed_rad_s"] + k}
        write_table(Table(path, columns), path)
    return paths


def test_the_same_samples_under_two_names_are_refused(three_runs: list[Path]) -> None:
    three_runs[2].write_bytes(three_runs[0].read_bytes())
    with pytest.raises(UsageError, match=r"run_2\.csv: expected samples of its own, got those of .*run_0\.csv"):
        read_records(three_runs)


def test_all_faulty_recordings_are_named(three_runs: list[Path]) -> None:
    three_runs[0].unlink()
    three_runs[2].write_text("time_s\n1\n2\n")
    with pytest.raises(InputError, match=r"(?s)run_0\.csv: .*No such file.*run_2\.csv: column torque_m1_nm: missing"):
        read_records(three_runs)


def test_recordings_of_two_periods_are_refused(three_runs: list[Path], changed: Changed) -> None:
    three_runs[2].unlink()
    write_table(changed(time_s=np.arange(40) * 0.02), three_runs[2])
    with pytest.raises(RecordingError, match=r"run_2\.csv: expected the sampling period of .*run_0\.csv, 0\.01 s"):
        read_records(three_runs)


def bench_table(tmp_path: Path) -> Table:
    rows = np.arange(20.0)
    force, motion = 10.0 * rows, 0.5 * rows
    force[4], motion[7] = np.nan, np.nan
    return Table(tmp_path / "bench.csv", {"t": 0.1 * rows, "f": force, "x": motion})


@pytest.mark.parametrize(
    "named", [{"torque": [{"column": "f", "scale": 2.0}]}, {"force": {"column": "f", "scale": 2.0}}]
)
def test_on_a_bench_the_position_is_imposed_and_the_torque_is_the_output(tmp_path: Path, named: dict[str, Any]) -> None:
    config = signals(time={"column": "t"}, position={"column": "x", "scale": 3.0}, **named)
    write_table(bench_table(tmp_path), tmp_path / "bench.csv")
    record = read_record(tmp_path / "bench.csv", config, on_bench=True)
    assert record.kind is OutputKind.FORCE
    assert record.imposed == pytest.approx(1.5 * np.arange(20.0))  # bridged where it is missing
    assert np.flatnonzero(~record.okay).tolist() == [4, 7]
    assert record.output[record.okay] == pytest.approx((20.0 * np.arange(20.0))[record.okay])
    assert record.torque_trusted.all()
    assert read_records([tmp_path / "bench.csv"], config, True)[0].imposed is not None


@pytest.mark.parametrize("factor", [1e-300, 1e-100, 1e-20, 1e20, 1e25])
@pytest.mark.parametrize("column", ["torque_m1_nm", "speed_rad_s", "time_s"])
def test_values_that_no_drive_has_are_refused_by_file_and_column(
    tmp_path: Path, own_table: Table, column: str, factor: float
) -> None:
    scaled = Table(tmp_path / "x.csv", {**own_table.columns, column: own_table.columns[column] * factor})
    write_table(scaled, tmp_path / "x.csv")
    said = "expected a sampling period between" if column == "time_s" else f"column {column}: expected a signal in SI"
    with pytest.raises(RecordingError, match=rf"x\.csv: {said}"):
        read_record(tmp_path / "x.csv")


def test_a_torque_that_is_zero_throughout_is_a_torque(tmp_path: Path, own_table: Table) -> None:
    idle = Table(tmp_path / "x.csv", {**own_table.columns, "torque_m1_nm": np.zeros(own_table.n_rows)})
    write_table(idle, tmp_path / "x.csv")
    assert not read_record(tmp_path / "x.csv").torque_nm[:, 0].any()


SIGNALLING_NAN = np.array([0x7FF4000000000000], dtype=np.uint64).view(np.float64)


@pytest.mark.parametrize("suffix", [".parquet", ".h5", ".mat", ".mf4"])
def test_a_signalling_nan_is_a_missing_value_like_any_other(tmp_path: Path, own_table: Table, suffix: str) -> None:
    columns = {name: column.copy() for name, column in own_table.columns.items()}
    columns["torque_m1_nm"][3:4] = columns["speed_rad_s"][5:6] = SIGNALLING_NAN
    path = tmp_path / f"run{suffix}"
    write_table(Table(path, columns), path)
    assert np.flatnonzero(~read_record(path).okay).tolist() == [3, 5]


def _drive(path: Path, **changed: np.ndarray) -> Path:
    n = 400
    t = 0.01 * np.arange(n)
    torque = np.where(np.sin(7.0 * t) > 0.0, 40.0, -20.0)
    columns = {"t": t, "T1": torque, "T2": torque + 0.1 * np.sin(t), "n": 50.0 + np.sin(t) + t, **changed}
    rows = zip(*columns.values(), strict=True)
    path.write_text(",".join(columns) + "\n" + "".join(",".join(map(repr, map(float, row))) + "\n" for row in rows))
    return path


_BY_NAME = {"time": {"column": "t"}, "torque": [{"column": "T1"}, {"column": "T2"}], "speed": {"column": "n"}}


def _lines_of(path: Path, signals: dict[str, object] = _BY_NAME) -> list[str]:
    lines: list[str] = []
    read_record(path, SignalsConfig.model_validate(signals), tell=lines.append)
    return lines


@pytest.mark.parametrize(
    ("changed", "signals", "said"),
    [
        ({}, {**_BY_NAME, "torque": [{"column": "T1"}, {"column": "T1"}]}, "got it twice"),
        ({"t": np.arange(400.0)}, _BY_NAME, "got the numbers of the rows"),
        ({"T2": -np.where(np.sin(0.07 * np.arange(400)) > 0.0, 40.0, -20.0)}, _BY_NAME, "scale = -1.0"),
    ],
    ids=["twice", "row numbers", "turned"],
)
def test_channels_that_can_not_be_what_they_are_named_are_refused(
    changed: dict[str, np.ndarray], signals: dict[str, object], said: str, tmp_path: Path
) -> None:
    with pytest.raises(RecordingError, match=said):
        _lines_of(_drive(tmp_path / "a.csv", **changed), signals)


@pytest.mark.parametrize("keys", [{"from_s": 2.0, "to_s": 1.0}, {"from_s": 1.0, "stretches": [[0.0, 1.0]]}])
def test_stretches_that_are_none_are_refused(keys: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        SignalsConfig.model_validate({**_BY_NAME, **keys})
