"""``hil runs`` as a user has it."""

import csv
import json
import signal
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hil.cli.main import run as hil
from hil.config.rig_file import read_rig
from hil.recording import Table, write_table
from hil.recording.checksum import text_sha256
from hil.store import RunStore, register_run
from tests.cli.conftest import await_rows
from tests.rig.serving import addresses, served

Capture = pytest.CaptureFixture[str]

RIG = 'name = "bench"\nspeed = {speed}\n'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Three runs: two cruises at two speeds, one of them with results, and a tip that was stopped."""
    runs = (
        ("a.csv", "cruise", "complete"),
        ("b.mf4", "cruise", "complete"),
        ("c.h5", "tip", "stopped by the operator"),
    )
    for number, (name, experiment, ended) in enumerate(runs, start=1):
        rig = RIG.format(speed=10 * number)
        said = {
            "experiment": experiment,
            "started_utc": f"2026-11-2{number}T10:00:00+00:00",
            "rig_file": rig,
            "rig_sha256": text_sha256(rig),
            "eds_m1_sha256": "ab" * 32,
        }
        columns = {"time_s": np.arange(20) * 0.1, "speed_rad_s": np.full(20, float(number))}
        write_table(Table(tmp_path / name, columns, {"time_s": "s"}, said), tmp_path / name)
        register_run(tmp_path / name, ended)
    found = {"recordings": [{"name": "a", "online": {"resonance": {"frequency_hz": 8.22, "damping": 0.057}}}]}
    diagnosis = {
        "verdict": "explained",
        "parameters": {"J_M": {"value": 1.52, "unit": "kg m^2"}},
        "effects": [{"name": "backlash", "parameters": {"gap_rad": {"value": 0.021, "unit": "rad"}}}],
    }
    with RunStore(tmp_path) as store:
        store.attach(1, "identification", found)
        store.attach(1, "diagnosis", diagnosis)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")
    return tmp_path


def documents(capsys: Capture, *arguments: str) -> dict:
    assert hil(["runs", *arguments, "--json"]) == 0
    return dict(json.loads(capsys.readouterr().out))


def test_runs_are_listed_with_what_tells_them_apart(folder: Path, capsys: Capture) -> None:
    assert hil(["runs"]) == 0
    head, *lines = capsys.readouterr().out.splitlines()
    assert head.split() == ["run", "started", "(UTC)", "experiment", "length", "ended", "verdict", "recording"]
    assert [line.split()[0] for line in lines] == ["1", "2", "3"]
    assert lines[0].split() == ["1", "2026-11-21", "10:00", "cruise", "2", "s", "explained", "a.csv"]
    assert "stopped by the operator" in lines[2]


@pytest.mark.parametrize(
    ("wanted", "found"),
    [
        (("--experiment", "tip"), [3]),
        (("--until", "2026-11-22"), [1, 2]),
        (("--since", "2026-11-22"), [2, 3]),
        (("--verdict", "explained"), [1]),
        (("--experiment", "cruise", "--verdict", "explained"), [1]),
        (("--verdict", "unexplained"), []),
        (("--rig", "bench"), [1, 2, 3]),
        (("--rig", "other"), []),
    ],
)
def test_runs_are_found_by_experiment_date_and_verdict(
    folder: Path, capsys: Capture, wanted: tuple[str, ...], found: list[int]
) -> None:
    assert [each["id"] for each in documents(capsys, *wanted)["runs"]] == found


def test_one_run_is_shown_with_the_state_of_its_recording(folder: Path, capsys: Capture) -> None:
    assert hil(["runs", "show", "1"]) == 0
    said = capsys.readouterr().out
    for line in ("whole, checksum verified", "bench, SHA-256", "resonance [Hz] on line", "backlash.gap_rad [rad]"):
        assert line in said
    document = documents(capsys, "show", "1")
    assert document["results"]["J_M [kg m^2]"] == 1.52
    assert document["rig_file"] == RIG.format(speed=10)
    assert document["eds_sha256"] == {"m1": "ab" * 32}
    (folder / "a.csv").write_text("time_s,speed_rad_s\n0.0,1.0\n", encoding="utf-8")
    assert "damaged, or was changed" in documents(capsys, "show", "1")["recording_state"]


def test_a_note_and_a_result_stay_with_their_run(folder: Path, capsys: Capture) -> None:
    (folder / "result.json").write_text('{"answer": 42}', encoding="utf-8")
    assert hil(["runs", "note", "2", "belt was loose"]) == 0
    assert hil(["runs", "attach", "2", "own_result", "result.json"]) == 0
    capsys.readouterr()
    for run, kept in (("2", True), ("1", False)):
        assert hil(["runs", "show", run]) == 0
        said = capsys.readouterr().out
        assert ("belt was loose" in said, "result.json" in said) == (kept, kept)
    assert [each["id"] for each in documents(capsys, "--text", "belt was")["runs"]] == [2]
    assert hil(["runs", "attach", "2", "own_result", "missing.json"]) == 2
    assert hil(["runs", "note", "9", "text"]) == 2


def test_alarms_are_listed_and_shown(folder: Path, capsys: Capture) -> None:
    level = {"value": 8.2, "ci95": [8.1, 8.3]}
    alarm = {
        "time_s": 60.0,
        "changed_between_s": [50.0, 55.0],
        "quantity": "resonance_hz",
        "before": level,
        "after": {"value": 7.6, "ci95": [7.5, 7.7]},
        "settled": True,
        "evidence": {"statistic": 31.0, "threshold": 12.0, "false_alarms_per_hour": 0.01},
    }
    with RunStore(folder) as store:
        store.attach(2, "online", {"alarms": [alarm]})
    assert hil(["runs", "--store", str(folder)]) == 0
    head, _, second, _ = capsys.readouterr().out.splitlines()
    assert "alarms" in head
    assert second[head.index("alarms") :].split()[0] == "1"
    assert hil(["runs", "show", "2", "--store", str(folder)]) == 0
    shown = capsys.readouterr().out
    assert "ALARM                           resonance_hz changed from 8.2 (8.1 to 8.3) to 7.6 (7.5 to 7.7)" in shown
    assert hil(["runs", "show", "2", "--store", str(folder), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["alarms"] == len(document["alarm_statements"]) == 1


def test_nothing_is_deleted_without_being_asked(folder: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    assert hil(["runs", "delete", "1"]) == 2
    assert "Expected --yes" in capsys.readouterr().err
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True, raising=False)
    monkeypatch.setattr("typer.confirm", lambda _: False)
    assert hil(["runs", "delete", "1"]) == 2
    assert "Nothing was deleted" in capsys.readouterr().err
    assert len(documents(capsys)["runs"]) == 3
    assert (folder / "a.csv").exists()


def test_a_run_is_deleted_and_its_recording_only_if_asked(folder: Path, capsys: Capture) -> None:
    assert hil(["runs", "delete", "2", "--yes"]) == 0
    assert (folder / "b.mf4").exists()
    assert hil(["runs", "delete", "1", "--yes", "--with-recording"]) == 0
    assert "deleted a.csv" in capsys.readouterr().out.replace("./", "")
    assert not (folder / "a.csv").exists()
    assert not (folder / "a.csv.json").exists()
    assert [run["id"] for run in documents(capsys)["runs"]] == [3]


def test_runs_are_exported_as_a_table_and_as_an_archive(folder: Path, capsys: Capture) -> None:
    assert hil(["runs", "export", "--out", "all.csv"]) == 0
    with (folder / "all.csv").open(encoding="utf-8", newline="") as file:
        assert [row["experiment"] for row in csv.DictReader(file)] == ["cruise", "cruise", "tip"]
    assert hil(["runs", "export", "1", "--out", "one.zip"]) == 0
    with zipfile.ZipFile(folder / "one.zip") as archive:
        names = set(archive.namelist())
        assert {"run_1/a.csv", "run_1/a.csv.json", "run_1/run.json", "run_1/rig.toml"} <= names
        assert archive.read("run_1/a.csv") == (folder / "a.csv").read_bytes()
        assert json.loads(archive.read("run_1/attachments/2_diagnosis.txt"))["verdict"] == "explained"
    assert hil(["runs", "export", "--out", "all.json"]) == 0
    assert len(json.loads((folder / "all.json").read_text(encoding="utf-8"))["runs"]) == 3
    for out in ("all.csv", "all.xlsx"):
        assert hil(["runs", "export", "--out", out]) == 2


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "expected a list of runs, there is none"),
        (["show", "1"], "expected a list of runs, there is none"),
        (["rebuild", "--store", "nowhere"], "expected an existing folder, got nowhere"),
        (["--since", "yesterday"], "--since: expected a date such as 2026-11-21, got 'yesterday'"),
    ],
)
def test_a_look_makes_no_store(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture, arguments: list[str], said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert hil(["runs", *arguments]) == 2
    assert said in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.campaign
def test_a_run_enters_itself_also_one_that_was_stopped(
    spawn: Callable[..., subprocess.Popen[str]], short_rig: Path, tmp_path: Path, capsys: Capture
) -> None:
    with served(read_rig(short_rig), bus_url="ws://127.0.0.1:0/") as (server, _):
        run = ["run", str(short_rig), "reversal", *addresses(server), "--out"]
        assert hil([*run, str(tmp_path / "whole.csv"), "--pace", "fast"]) == 0
        process = spawn("run", str(short_rig), "cruise", *addresses(server), "--out", str(tmp_path / "cut.csv"))
        await_rows(tmp_path / "cut.part.csv", process)
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 130
    capsys.readouterr()
    whole, cut = documents(capsys, "--store", str(tmp_path))["runs"]
    assert (whole["experiment"], whole["outcome"]) == ("reversal", "complete")
    assert [entry["kind"] for entry in whole["attachments"]] == ["online"]
    assert (cut["experiment"], cut["outcome"]) == ("cruise", "interrupted")
    assert cut["samples"] >= 10
