"""MATLAB structs, matrices and timetables by address; HDF5 matrices, too."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io

from hil.errors import RecordingError
from hil.recording import SignalsConfig, read_record, read_table
from hil.recording.request import canonical

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
