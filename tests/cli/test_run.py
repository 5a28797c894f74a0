"""``hil run``: recordings, exit statuses, and drives that are disarmed however it ends."""

import json
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hil.cli.main import run
from hil.config.rig_file import read_rig
from hil.errors import UsageError
from hil.recording.formats import read_table
from tests.cli.conftest import await_rows
from tests.rig.observer import assert_disarmed
from tests.rig.serving import addresses, served

NOWHERE = ("--bus", "ws://127.0.0.1:9/", "--modbus", "127.0.0.1:9")


@pytest.mark.campaign
def test_records_from_another_process(
    simulate: Callable[..., Any], short_rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    simulation = simulate(short_rig)
    out = tmp_path / "run.csv"
    command = ["run", str(short_rig), "reversal", "--out", str(out), "--pace", "fast", *simulation.addresses]
    assert run([*command, "--json"]) == 0
    printed = capsys.readouterr()
    assert json.loads(printed.out)["recorded"] == 300
    assert printed.err == ""  # no progress where there is no terminal
    table = read_table(out)
    assert table.columns["time_s"][-1] == 2.99
    assert not table.columns["flags"].any()
    assert abs(table.columns["speed_rad_s"]).max() > 0.5
    assert_disarmed(simulation.bus, 1, 2)


@pytest.mark.parametrize(
    "number",
    [signal.SIGTERM, *(pytest.param(number, marks=pytest.mark.campaign) for number in (signal.SIGINT, signal.SIGHUP))],
)
def test_signal_in_the_middle_keeps_the_recording_and_disarms(
    spawn: Callable[..., subprocess.Popen[str]], short_rig: Path, tmp_path: Path, number: signal.Signals
) -> None:
    out = tmp_path / "run.csv"
    with served(read_rig(short_rig), bus_url="ws://127.0.0.1:0/") as (server, _):
        process = spawn("run", str(short_rig), "cruise", "--out", str(out), *addresses(server))
        await_rows(tmp_path / "run.part.csv", process)
        process.send_signal(number)
        _, complaints = process.communicate(timeout=60)
        assert process.returncode == 130
        assert_disarmed(server.bus_url, 1, 2)
    times = read_table(out).columns["time_s"]
    assert 0 < len(times) < 3000
    assert f"holds the {len(times)} samples" in complaints
    assert not (tmp_path / "run.part.csv").exists()


@pytest.mark.parametrize("bus", ["socketcan:can0", "ws://10.0.0.1:54701/"])
def test_fast_is_for_simulated_rigs_only(
    short_rig: Path, tmp_path: Path, bus: str, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "r.csv")
    assert run(["run", str(short_rig), "cruise", "--out", out, "--pace", "fast", "--bus", bus]) == 2
    assert bus in capsys.readouterr().err


def test_dry_run_opens_no_bus_and_writes_nothing(
    short_rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["run", str(short_rig), "tip", "--dry-run", *NOWHERE]) == 0
    printed = capsys.readouterr().out
    assert "30.0 s of it recorded" in printed
    assert "speed in the recorded part" in printed
    assert list(tmp_path.iterdir()) == [short_rig]


def test_recording_says_what_it_is_and_estimates_stand_next_to_it(
    short_rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "r.parquet"
    with served(read_rig(short_rig)) as (server, _):
        options = ("--out", str(out), "--pace", "fast", *addresses(server))
        assert run(["run", str(short_rig), "reversal", *options, "--json"]) == 0
    metadata = read_table(out).metadata
    assert metadata["experiment"] == "reversal"
    assert metadata["rig_file"] == short_rig.read_text(encoding="utf-8")
    assert len(metadata["eds_m1_sha256"]) == 64
    course = json.loads((tmp_path / "r.online.json").read_text(encoding="utf-8"))
    assert course["schema"] == "hil.online/1"
    assert course["samples"] == 300
    assert len(course["course"]["resonance_hz"]) == course["estimates"] == 150
    assert course["alarms"] == []
    summary = json.loads(capsys.readouterr().out)["online"]
    assert summary == {name: value for name, value in course.items() if name not in ("course", "every")}


def test_course_that_can_not_be_kept_is_said_and_the_run_is_entered_all_the_same(
    short_rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(folder: Path, files: object) -> None:
        raise UsageError(f"{folder}: no room")

    monkeypatch.setattr("hil.cli.run_job.publish", full)
    out = tmp_path / "run.csv"
    with served(read_rig(short_rig)) as (server, _):
        assert run(["run", str(short_rig), "reversal", "--out", str(out), "--pace", "fast", *addresses(server)]) == 0
    assert f"{tmp_path / 'run.online.json'} is missing: {tmp_path}: no room" in capsys.readouterr().err
    assert run(["runs", "--store", str(tmp_path)]) == 0
    assert "reversal" in capsys.readouterr().out


@pytest.mark.parametrize(
    "number",
    [signal.SIGHUP, *(pytest.param(number, marks=pytest.mark.campaign) for number in (signal.SIGINT, signal.SIGTERM))],
)
def test_serves_until_a_signal_and_prints_one_line(
    simulate: Callable[..., Any], short_rig: Path, number: signal.Signals
) -> None:
    simulation = simulate(short_rig)
    assert simulation.bus.startswith("ws://127.0.0.1:")
    assert not simulation.bus.endswith(":0/")
    simulation.process.send_signal(number)
    rest, complaints = simulation.process.communicate(timeout=60)
    assert simulation.process.returncode == 0
    assert (rest, complaints) == ("", "")


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (("--bus", "ws://0.0.0.0:0/"), "this machine only"),
        (("--bus", "socketcan:can0"), "expected ws://HOST:PORT/"),
        (("--modbus", "10.0.0.1:502"), "this machine only"),
        (("--modbus", "nonsense"), "expected HOST:PORT"),
        (("--effect", "backlash:gap"), "expected key=number"),
        (("--effect", "gremlins"), "gremlins"),
    ],
)
def test_refuses_what_it_can_t_serve(
    short_rig: Path, options: tuple[str, ...], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["sim", str(short_rig), *options]) == 2
    printed = capsys.readouterr()
    assert named in printed.err
    assert printed.out == ""
