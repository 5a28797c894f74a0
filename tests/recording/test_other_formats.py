"""Parquet, older .mat and the registry: what is read, what is refused, and that nothing is overwritten."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
import scipy.io

from hil.errors import RecordingError
from hil.recording import Table, read_table, write_table
from hil.recording.checksum import sealed
from hil.recording.formats import FORMATS


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
