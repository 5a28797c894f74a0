"""Files of other programs: what ``hil look`` prints for them reads them, in SI units, without an edit."""

from __future__ import annotations

import json
import re
import struct
import tomllib
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
import scipy.io

from estimator.signals.record import Record
from hil.errors import RecordingError
from hil.recording import read_table
from hil.recording.look import look
from hil.recording.request import Request
from hil.recording.signals import read_record
from hil.recording.signals_config import SignalsConfig
from tests.recording import foreign_files as made

EDITED = {"twincat_scope": {"time": {"column": "Name", "scale": 0.001}}}
"""The line that is edited where the file says no unit and ``hil look`` says so."""


def _read(path: Path, dbc: Path | None = None, edited: Mapping[str, Any] = MappingProxyType({})) -> Record:
    table = tomllib.loads("\n".join(look(path, dbc).signals))["signals"]
    return read_record(path, SignalsConfig.model_validate({**table, **edited}), dbc=dbc)


def _is_as_made(record: Record, tolerance: float) -> None:
    assert record.sample_time_s == pytest.approx(made.PERIOD_S, rel=1e-4)
    assert record.total_torque_nm == pytest.approx(made.TORQUE_M1 + made.TORQUE_M2, abs=tolerance)
    assert record.output == pytest.approx(made.SPEED, abs=tolerance)
    assert record.okay.all()
    assert np.ptp(record.time_s) == pytest.approx(made.TIME[-1], rel=1e-4)


@pytest.mark.parametrize("name", made.MAKERS)
def test_what_look_prints_reads_the_file(name: str, tmp_path: Path) -> None:
    _is_as_made(_read(made.MAKERS[name](tmp_path), edited=EDITED.get(name, {})), 1e-5)


def test_the_time_in_a_matrix_is_recognised_by_what_it_does(tmp_path: Path) -> None:
    path = tmp_path / "run.mat"
    scipy.io.savemat(path, {"data": np.column_stack([made.TIME, made.TORQUE_M1, made.SPEED])})
    assert look(path).signals[1] == 'time = { column = "data(:,1)" }'


@pytest.mark.parametrize("suffix", made.BUS_LOGS)
def test_a_log_of_a_bus_is_read_with_a_dbc(suffix: str, tmp_path: Path) -> None:
    _is_as_made(_read(made.BUS_LOGS[suffix](tmp_path), made.dbc_of(tmp_path)), 2e-2)


@pytest.mark.parametrize("suffix", [".log", ".asc", ".trc"])
def test_odd_lines_of_a_bus_log_are_skipped_and_counted(suffix: str, tmp_path: Path) -> None:
    path = made.BUS_LOGS[suffix](tmp_path)
    lines = path.read_text().splitlines(keepends=True)
    for number in (300, 600, 900):
        lines.insert(number, "   17)  1.2.3 DT what is this\n")
    path.write_text("".join(lines))
    lines: list[str] = []
    table = tomllib.loads("\n".join(look(path, made.dbc_of(tmp_path)).signals))["signals"]
    record = read_record(path, SignalsConfig.model_validate(table), dbc=tmp_path / "drive.dbc", tell=lines.append)
    _is_as_made(record, 2e-2)
    assert any(re.search(r"\b[34] lines skipped", line) for line in lines)  # a header line of .asc looks like a frame


@pytest.mark.parametrize(
    ("dbc", "said"),
    [
        (made.DBC.replace("BO_ 385", "BO_ 386"), "none of its 1000 frames described"),
        (made.DBC.replace("16|16@1-", "8|16@1-"), "overlapping"),
        ("nothing", "expected a DBC file"),
    ],
)
def test_a_dbc_that_does_not_describe_the_log_is_named(dbc: str, said: str, tmp_path: Path) -> None:
    path = made.BUS_LOGS[".log"](tmp_path)
    (tmp_path / "other.dbc").write_text(dbc)
    with pytest.raises(RecordingError, match=said):
        look(path, tmp_path / "other.dbc")


def test_a_data_log_has_arrays_whole_numbers_and_truth_and_may_be_cut(tmp_path: Path) -> None:
    entries = {
        "pair": ("double[]", [struct.pack("<2d", k, 10.0 * k) for k in range(4)]),
        "count": ("int64", [struct.pack("<q", k) for k in range(4)]),
        "on": ("boolean", [bytes([k % 2]) for k in range(4)]),
        "said": ("string", [b"text"] * 4),
    }
    path = made.wpilib_data_log(tmp_path / "run.wpilog", entries, [100, 20_100, 40_100, 60_100])
    path.write_bytes(path.read_bytes()[:-3])
    table = read_table(path)
    assert {name: column.tolist() for name, column in table.columns.items() if "time" not in name.lower()} == {
        "pair[0]": [0.0, 1.0, 2.0, 3.0],
        "pair[1]": [0.0, 10.0, 20.0, 30.0],
        "count": [0.0, 1.0, 2.0, 3.0],
        "on": [0.0, 1.0, 0.0, 1.0],
    }


def test_the_tests_of_sysid_are_read_in_the_order_of_their_times(tmp_path: Path) -> None:
    tests = {"fast-forward": [[5.0, 7.0, 1.0, 2.0]], "slow-forward": [[1.0, 0.25, 0.0, 0.0], [1.02, 0.26, 0.1, 0.2]]}
    (tmp_path / "run.json").write_text(json.dumps({"sysid": True, "test": "Simple", "units": "Rotations", **tests}))
    table = read_table(tmp_path / "run.json")
    assert table.columns["time_s"].tolist() == [1.0, 1.02, 5.0]
    assert table.columns["voltage"].tolist() == [0.25, 0.26, 7.0]
    assert table.columns["test"].tolist() == ["slow-forward", "slow-forward", "fast-forward"]
    assert dict(table.units) == {"time_s": "s", "voltage": "V", "position": "rev", "velocity": "rev/s"}


@pytest.mark.parametrize(
    "suffix",
    [
        ".npz",
        ".npy",
        ".xlsx",
        ".ods",
        ".arrow",
        ".gz",
        ".json",
        ".wpilog",
        ".feather",
        ".jsonl",
        ".tdms",
        ".mcap",
        ".blf",
        ".h5",
    ],
)
@pytest.mark.parametrize("content", [b"", b"\x00" * 100, b"PK\x03\x04 no archive", bytes(range(256)) * 8])
def test_what_is_no_such_file_is_refused(suffix: str, content: bytes, tmp_path: Path) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=r"expected"):
        read_table(path, Request(dbc=made.dbc_of(tmp_path)))


def test_an_array_of_pickled_objects_is_refused_and_not_run(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    np.save(path, np.array([{"run": print}], dtype=object), allow_pickle=True)
    with pytest.raises(RecordingError, match="arrays of numbers"):
        read_table(path)
