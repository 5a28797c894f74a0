"""Parquet, older .mat and the registry: what is read, what is refused, and that nothing is overwritten."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
import scipy.io

from hil.errors import RecordingError
from hil.recording import SignalsConfig, Table, read_record, read_table, write_table
from hil.recording.checksum import sealed
from hil.recording.formats import FORMATS
from hil.recording.request import canonical


def test_parquet_keeps_units_and_metadata(tmp_path: Path, own_table: Table) -> None:
    write_table(own_table, tmp_path / "run.parquet")
    table = read_table(tmp_path / "run.parquet")
    assert dict(table.units) == dict(own_table.units)
    assert dict(table.metadata) == dict(sealed(own_table).metadata)


def test_parquet_of_other_programs_is_read(tmp_path: Path) -> None:
    content = pa.table(
        {
            "single": pa.array([0.5, None], pa.float32()),
            "small": pa.array([1, 2], pa.int8()),
            "gap": pa.array([1, None], pa.int32()),
            "bit": pa.array([True, False]),
            "none": pa.nulls(2),
            "text": pa.array(["a", None]),
            "list": pa.array([[1], [2, 3]]),
        }
    ).replace_schema_metadata({"pandas": "{}", "who": "me"})
    pa.parquet.write_table(content, tmp_path / "foreign.parquet")
    table = read_table(tmp_path / "foreign.parquet")
    np.testing.assert_array_equal(table.columns["single"], [0.5, np.nan])
    np.testing.assert_array_equal(table.columns["gap"], [1.0, np.nan])
    np.testing.assert_array_equal(table.columns["none"], [np.nan, np.nan])
    assert table.columns["small"].tolist() == [1, 2]
    assert table.columns["bit"].tolist() == [1, 0]
    assert table.columns["text"].tolist() == ["a", ""]
    assert table.columns["list"].tolist() == ["[1]", "[2, 3]"]
    assert dict(table.metadata) == {"who": "me"}
    with pytest.raises(RecordingError, match="row 1, column list: expected a finite number"):
        table.numeric(["list"])


@pytest.mark.parametrize("kept", [0, 10, 400])
def test_a_truncated_parquet_file_is_refused(tmp_path: Path, own_table: Table, kept: int) -> None:
    write_table(own_table, tmp_path / "run.parquet")
    whole = (tmp_path / "run.parquet").read_bytes()
    (tmp_path / "cut.parquet").write_bytes(whole[:kept])
    with pytest.raises(RecordingError, match="damaged or truncated"):
        read_table(tmp_path / "cut.parquet")


def test_mat_vectors_of_one_length_are_columns_and_scalars_metadata(tmp_path: Path) -> None:
    scipy.io.savemat(
        tmp_path / "drive.mat",
        {
            "t": np.arange(5.0)[:, np.newaxis],
            "v": np.arange(5.0)[np.newaxis, :],
            "count": np.arange(5, dtype=np.int16),
            "gain": 35.15,
            "other": np.arange(3.0),
            "matrix": np.eye(5),
            "note": "text",
        },
    )
    table = read_table(tmp_path / "drive.mat")
    assert sorted(table.columns) == ["count", *(f"matrix(:,{k})" for k in range(1, 6)), "t", "v"]
    assert table.columns["t"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert table.columns["count"].dtype == np.int64
    assert dict(table.metadata) == {"gain": "35.15"}


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_file_that_is_not_there_is_refused(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(RecordingError, match="expected a readable file, got: No such file"):
        read_table(tmp_path / f"run{suffix}")


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("run.mdf", "ends in one of .csv, .parquet"),
        ("run.txt", "ends in one of .csv, .parquet"),
        ("taken.csv", "a recording is never overwritten"),
        ("nowhere/run.csv", "expected an existing folder"),
    ],
)
def test_a_recording_that_cannot_be_made_is_refused(tmp_path: Path, own_table: Table, name: str, said: str) -> None:
    (tmp_path / "taken.csv").write_text("mine")
    with pytest.raises(RecordingError) as refusal:
        write_table(own_table, tmp_path / name)
    assert said in str(refusal.value)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"taken.csv": "mine"}


TIME = np.arange(50) * 0.01
TORQUE, SPEED = np.sin(TIME), np.cos(TIME)


@pytest.mark.parametrize(
    ("address", "listed"),
    [
        ("data[:, 3]", "data(:,4)"),
        ("data(:, 3)", "data(:,3)"),
        ("log.T[0, :]", "log.T(1,:)"),
        ("log.motor.speed", "log.motor.speed"),
        ("signals(2).values( : ,1 )", "signals(2).values(:,1)"),
    ],
)
def test_brackets_count_as_python_does_and_parentheses_as_matlab(address: str, listed: str) -> None:
    assert canonical(address) == listed


def read(path: Path, time: str, torque: str, speed: str) -> None:
    tables = {"time": {"column": time}, "torque": [{"column": torque}], "speed": {"column": speed}}
    record = read_record(path, SignalsConfig.model_validate(tables))
    assert record.sample_time_s == 0.01
    np.testing.assert_allclose(record.torque_nm[:, 0], TORQUE)
    np.testing.assert_allclose(record.output, SPEED)


STRUCT = {
    "t": TIME,
    "motor": {"w": SPEED, "T": np.column_stack([SPEED, TORQUE])},
    "signals": np.array([{"values": TORQUE}, {"values": SPEED}], dtype=object),
}


@pytest.mark.parametrize(
    ("time", "torque", "speed"),
    [
        ("log.t", "log.motor.T(:,2)", "log.motor.w"),
        ("log.t", "log.motor.T[:, 1]", "log.motor.w"),
        ("data(:,1)", "data(:,2)", "data(:,3)"),
        ("data[:, 0]", "data[:, 1]", "data[:, 2]"),
        ("wide(1,:)", "wide(2,:)", "wide(3,:)"),
        ("log.t", "log.signals(1).values", "log.signals(2).values"),
    ],
)
def test_structs_and_matrices_are_read_by_address(tmp_path: Path, time: str, torque: str, speed: str) -> None:
    matrix = np.column_stack([TIME, TORQUE, SPEED])
    scipy.io.savemat(tmp_path / "drive.mat", {"log": STRUCT, "data": matrix, "wide": matrix.T, "other": np.eye(3)})
    read(tmp_path / "drive.mat", time, torque, speed)


def test_a_struct_of_version_73_is_read_by_address(tmp_path: Path) -> None:
    path = tmp_path / "drive.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in (("log/t", TIME[None]), ("log/m/w", SPEED[None]), ("d", np.vstack([SPEED, TORQUE]))):
            file[name] = values  # MATLAB's arrays are column-major: a matrix of two columns has two rows here
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
    content = bytearray(path.read_bytes())
    content[:128] = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    path.write_bytes(content)
    read(path, "log.t", "d(:,2)", "log.m.w")


def test_an_address_that_is_not_there_is_refused_with_those_that_are(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "drive.mat", {"log": {"t": TIME, "w": SPEED}})
    with pytest.raises(RecordingError, match=r"column log.v: missing, the file has log.t, log.w"):
        read_table(tmp_path / "drive.mat").numeric(["log.v"])


def test_a_refusal_lists_names_as_people_read_them(tmp_path: Path) -> None:
    names = [f"c{i}" for i in range(149)] + ["x" * 1000]
    (tmp_path / "wide.csv").write_text("\n".join([",".join(names), *[",".join(["1.0"] * 150)] * 3]), "utf-8")
    with pytest.raises(RecordingError, match=r"column v: missing, the file has c0, c1, .* and 50 more\.") as refused:
        read_table(tmp_path / "wide.csv").numeric(["v"])
    assert len(str(refused.value)) < 2000
