"""``hil run --trace`` and ``hil replay``: the trace next to the recording, and the recording back from the trace."""

import json
from pathlib import Path

import pytest

from estimator.identification.chain import OnlineChain
from estimator.identification.online.adaptation import ConstantForgetting
from hil.cli.main import run
from hil.config.rig_file import read_rig
from hil.recording import read_record
from hil.recording.formats import read_table
from hil.report.identification_input import identified
from hil.rig.live import FORGETTING
from hil.rig.trace import SUFFIXES
from tests.chosen import one_in
from tests.estimator.identification.tracking.drives import Line, drives
from tests.rig.serving import addresses, served

MEASURED = ("time_s", "torque_m1_nm", "torque_m2_nm", "speed_rad_s")


def record(rig: Path, out: Path, trace: Path) -> int:
    with served(read_rig(rig)) as (server, _):
        options = ("--out", str(out), "--trace", str(trace), "--pace", "fast", *addresses(server))
        return run(["run", str(rig), "reversal", *options])


@pytest.mark.parametrize("suffix", one_in(3, SUFFIXES))
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


def test_replay_of_a_run_is_the_run_to_the_bit(
    short_rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    live, trace = tmp_path / "live.csv", tmp_path / "bus.blf"
    assert record(short_rig, live, trace) == 0
    assert "live.online.json" in capsys.readouterr().out
    course = (tmp_path / "live.online.json").read_bytes()
    again, from_bus = tmp_path / "again.json", tmp_path / "bus.json"
    assert run(["replay", str(live), "--estimate", str(again), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "hil.replay/1"
    assert document["online"]["samples"] == document["recorded"] == 300
    assert document["samples_per_s"] > 0
    assert again.read_bytes() == course
    assert run(["replay", str(trace), "--rig", str(short_rig), "--estimate", str(from_bus)]) == 0
    assert from_bus.read_bytes() == course


def written(recording: Path, duration_s: float, *lines: Line) -> Path:
    """Write a drive with these lines, one after the other."""
    drive = drives(4, 1, duration_s, lines)[0]
    columns = (drive.time_s, *drive.torque_nm.T, drive.output)
    rows = [",".join(map(repr, row)) for row in zip(*(column.tolist() for column in columns), strict=True)]
    recording.write_text("\n".join(["time_s,torque_m1_nm,torque_m2_nm,speed_rad_s", *rows]) + "\n", encoding="utf-8")
    return recording


@pytest.mark.campaign
def test_the_filter_of_an_earlier_run_is_the_papers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The estimate is that of the chain with L of the file; and another than with a filter that follows."""
    recording, out = written(tmp_path / "drive.csv", 30.0, Line()), tmp_path / "identified"
    assert run(["identify", str(recording), "--out", str(out)]) == 0
    with_l, without = tmp_path / "with.json", tmp_path / "without.json"
    identified_in = out / "identification.json"
    assert run(["replay", str(recording), "--estimate", str(with_l), "--filter", str(identified_in)]) == 0
    assert run(["replay", str(recording), "--estimate", str(without)]) == 0
    assert with_l.read_bytes() != without.read_bytes()
    found = identified(identified_in, None, ConstantForgetting(FORGETTING))
    chain = OnlineChain(found.settings, 0.01, found.L)
    mode = chain.run(read_record(recording))[-1].resonance
    assert mode is not None
    assert json.loads(with_l.read_text())["course"]["resonance_hz"][-1] == mode.frequency_hz
    capsys.readouterr()
    options = ["replay", str(recording), "--filter", str(identified_in), "--filter-run", "other"]
    assert run(options) == 2
    assert "expected a recording of" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("bus.blf",), "expected --rig with a bus trace"),
        (("r.csv", "--out", "again.csv"), "hil convert"),
        (("r.csv", "--all"), "expected no --all with a recording"),
        (("r.csv", "--speed", "0"), "above 0"),
        (("r.csv", "--filter-run", "run_1"), "expected --filter FILE with it"),
    ],
)
def test_options_that_make_no_sense_are_refused(
    options: tuple[str, ...], expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["replay", *options]) == 2
    assert expected in capsys.readouterr().err
