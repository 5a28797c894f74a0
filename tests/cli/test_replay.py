"""``hil run --trace`` and ``hil replay``: the trace beside the recording, and the recording back from the trace."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from hil.cli.main import run
from hil.config.rig_file import read_rig
from hil.recording.formats import read_table
from hil.rig.trace import SUFFIXES
from tests.rig.serving import served

MEASURED = ("time_s", "torque_m1_nm", "torque_m2_nm", "speed_rad_s")


def record(rig: Path, out: Path, trace: Path) -> int:
    with served(read_rig(rig)) as (server, _):
        addresses = ("--bus", server.bus_url, "--modbus", str(server.modbus))
        options = ("--out", str(out), "--trace", str(trace), "--pace", "fast", *addresses)
        return run(["run", str(rig), "reversal", *options])


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_recording_comes_back_from_its_trace(
    short_rig: Path, tmp_path: Path, suffix: str, capsys: pytest.CaptureFixture[str]
) -> None:
    live, trace, again = tmp_path / "live.csv", tmp_path / f"bus{suffix}", tmp_path / "again.parquet"
    assert record(short_rig, live, trace) == 0
    assert str(trace) in capsys.readouterr().out
    assert run(["replay", str(trace), "--rig", str(short_rig), "--out", str(again), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["recorded"] == 300
    one, other = read_table(live), read_table(again)
    for name in MEASURED:
        assert one.columns[name].tolist() == other.columns[name].tolist(), name
    assert other.metadata["replayed_from"] == trace.name


def test_trace_of_a_run_that_fails_is_kept_whole(short_rig: Path, tmp_path: Path) -> None:
    trace = tmp_path / "bus.blf"
    with served(read_rig(short_rig)) as (server, _):
        server.plc.close_clutch()
        addresses = ("--bus", server.bus_url, "--modbus", str(server.modbus))
        options = ("--out", str(tmp_path / "r.csv"), "--trace", str(trace), "--pace", "fast", *addresses)
        assert run(["run", str(short_rig), "cruise", *options]) == 3
    assert trace.exists()
    assert not (tmp_path / "r.csv").exists()


def test_trace_that_exists_is_refused_before_anything_is_armed(
    short_rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trace = tmp_path / "bus.blf"
    trace.write_text("mine", encoding="utf-8")
    assert record(short_rig, tmp_path / "r.csv", trace) == 2
    assert "never overwritten" in capsys.readouterr().err
    assert trace.read_text(encoding="utf-8") == "mine"


def test_trace_that_can_not_be_read_writes_nothing(
    short_rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trace, out = tmp_path / "bus.log", tmp_path / "again.csv"
    trace.write_text("no trace\n", encoding="utf-8")
    assert run(["replay", str(trace), "--rig", str(short_rig), "--out", str(out)]) == 2
    assert "bus.log: expected a bus trace" in capsys.readouterr().err
    assert not out.exists()
