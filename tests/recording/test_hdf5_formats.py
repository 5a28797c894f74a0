"""HDF5 and MATLAB v7.3: what other programs find in a file of ours, and what is read of theirs."""

from __future__ import annotations

import json
import re
from pathlib import Path

import h5py
import numpy as np
import pytest

from hil.recording import Table, read_table, write_table
from hil.recording.formats import read_metadata
from hil.recording.mat_format import variable_names
from hil.recording.table import as_text


@pytest.fixture
def mixed() -> Table:
    return Table(
        Path("run"),
        {
            "time_s": np.arange(4) * 0.01,
            "Throttle [%]": np.arange(4),
            "on": np.array([True, False, True, True]),
            "gear": as_text(["", "ä", "second", "ä"]),
        },
        {"time_s": "s", "Throttle [%]": "%"},
        {"experiment": "tip"},
    )


def test_hdf5_has_a_dataset_with_unit_for_each_column(tmp_path: Path, mixed: Table) -> None:
    write_table(mixed, tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5") as file:
        assert list(file["columns"]) == list(mixed.columns)
        assert file["columns/time_s"][()].tolist() == mixed.columns["time_s"].tolist()
        assert file["columns/Throttle [%]"].attrs["unit"] == "%"
        assert file["columns/on"].dtype == np.bool_
        assert [cell.decode() for cell in file["columns/gear"][()]] == ["", "ä", "second", "ä"]
        assert json.loads(file["recording_json"][()])["metadata"]["experiment"] == "tip"


def test_mat_v73_is_laid_out_as_matlab_writes_it(tmp_path: Path, mixed: Table) -> None:
    """Header: 116 bytes of text, 8 of subsystem offset, version 0x0200 and endian indicator, then HDF5 at 512."""
    write_table(mixed, tmp_path / "run.mat")
    content = (tmp_path / "run.mat").read_bytes()
    assert content[:19] == b"MATLAB 7.3 MAT-file"
    assert content[116:128] == bytes(8) + b"\x00\x02IM"
    assert content[512:520] == b"\x89HDF\r\n\x1a\n"
    with h5py.File(tmp_path / "run.mat") as file:
        classes = {name: file[name].attrs["MATLAB_class"] for name in file if name != "#refs#"}
        assert classes == {
            "time_s": b"double",
            "Throttle____": b"int64",
            "on": b"logical",
            "gear": b"cell",
            "recording_json": b"char",
        }
        assert file["time_s"].shape == (1, 4)  # a column of 4: MATLAB's order of dimensions is the other way round
        assert (file["on"].dtype, file["on"].attrs["MATLAB_int_decode"]) == (np.uint8, 1)
        empty, umlaut = (file[reference] for reference in file["gear"][0, :2])
        assert (empty.attrs["MATLAB_empty"], empty[()].tolist()) == (1, [0, 0])
        assert (umlaut.dtype, umlaut.shape, umlaut[0, 0]) == (np.uint16, (1, 1), ord("ä"))
        assert len(file["#refs#"]) == 3  # each different text is stored once


@pytest.mark.parametrize(
    ("names", "variables"),
    [
        (["a b", "a_b", "a-b"], ["a_b", "a_b_2", "a_b_3"]),
        (["1st", "_x", "ö"], ["x1st", "x_x", "x_"]),
        (["recording_json"], ["recording_json_2"]),
        (["x" * 70, "x" * 71], ["x" * 63, "x" * 53 + "_2"]),
    ],
)
def test_variables_have_names_that_matlab_takes_and_tells_apart(names: list[str], variables: list[str]) -> None:
    assert list(variable_names(names).values()) == variables


def matlab_variable(file: h5py.File, name: str, values: np.ndarray, matlab_class: str) -> None:
    file.create_dataset(name, data=values).attrs["MATLAB_class"] = np.bytes_(matlab_class)


@pytest.fixture
def theirs(tmp_path: Path) -> Path:
    """As MATLAB's ``save -v7.3`` leaves it."""
    path = tmp_path / "theirs.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        matlab_variable(file, "t", 0.01 * np.arange(30.0)[np.newaxis, :], "double")
        matlab_variable(file, "vir", np.arange(30, dtype=np.float32)[:, np.newaxis], "single")
        matlab_variable(file, "qm", np.arange(30.0)[np.newaxis, :], "double")
        matlab_variable(file, "on", np.ones((1, 30), dtype=np.uint8), "logical")
        matlab_variable(file, "other", np.arange(5.0)[np.newaxis, :], "double")
        matlab_variable(file, "gain", np.array([[35.15]]), "double")
        matlab_variable(file, "note", np.frombuffer("lap 2".encode("utf-16-le"), "<u2")[:, np.newaxis], "char")
        matlab_variable(file, "matrix", np.eye(3), "double")
    content = bytearray(path.read_bytes())
    content[:128] = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    path.write_bytes(content)
    return path


def test_a_v73_file_of_matlab_is_read(theirs: Path) -> None:
    table = read_table(theirs)
    assert sorted(table.columns) == ["on", "qm", "t", "vir"]
    assert table.columns["on"].dtype == np.bool_
    assert dict(table.metadata) == {"gain": "35.15", "note": "lap 2"} == dict(read_metadata(theirs))
    assert {re.split("[:(]", remark)[0] for remark in table.remarks} == {"matrix", "other"}
