"""Files of other programs: what ``hil look`` prints for them reads them, in SI units, without an edit."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
import scipy.io

from estimator.signals.record import Record
from hil.recording.look import look
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


def test_a_file_without_a_time_gets_no_period_that_was_not_measured(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("index,T1_Nm,n_rpm\n" + "".join(f"{k},{k % 3},{k % 5}\n" for k in range(20)))
    assert look(path).signals[1].startswith("# time = { sample_time_s = ... }")


@pytest.mark.parametrize("suffix", made.BUS_LOGS)
def test_a_log_of_a_bus_is_read_with_a_dbc(suffix: str, tmp_path: Path) -> None:
    _is_as_made(_read(made.BUS_LOGS[suffix](tmp_path), made.dbc_of(tmp_path)), 2e-2)
