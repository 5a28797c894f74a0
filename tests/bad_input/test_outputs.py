"""Places that can't be written to: refused before the work where that can be seen, and never half written."""

import importlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import pytest

from hil.cli.main import run
from hil.config.rig_file import read_rig
from hil.recording import read_table
from tests.bad_input.conftest import Refused
from tests.chosen import campaign
from tests.rig.observer import assert_disarmed
from tests.rig.serving import served

LITTLE_ROOM = 'ulimit -f 20 && exec "$@"'
"""Lets a process write files of 10 or 20 KiB, by shell; the short rig's reversal makes 31 KiB of CSV."""

NOWHERE = ("--bus", "ws://127.0.0.1:9/", "--modbus", "127.0.0.1:9")

COMMANDS = ["diagnose REC --model MODEL --out", "identify REC --out", "compare MODEL REC --out", "demo --seed 1 --out"]


def words(command: str, drive: Path) -> list[str]:
    places = {"MODEL": str(drive / "drive.toml"), "REC": str(drive / "run_1.csv")}
    return [places.get(word, word) for word in command.split()]


@pytest.mark.parametrize("command", COMMANDS)
def test_a_place_where_nothing_can_be_made(refused: Refused, drive: Path, command: str) -> None:
    assert "/proc/result: expected a folder to write into, got: " in refused(*words(command, drive), "/proc/result")


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("run.xlsx", "expected a name that ends in one of .csv, .parquet"),
        ("rig.toml/run.csv", "expected an existing folder"),
        ("none/run.csv", "expected an existing folder"),
    ],
)
def test_a_run_is_not_started_without_a_place(refused: Refused, short_rig: Path, name: str, said: str) -> None:
    out = short_rig.parent / name
    assert f"{out}: {said}" in refused("run", short_rig, "cruise", "--out", out, *NOWHERE)
    assert list(short_rig.parent.iterdir()) == [short_rig]


@pytest.mark.parametrize("name", ["run.csv", pytest.param("run.parquet", marks=pytest.mark.campaign)])
def test_a_full_disk_ends_the_run_disarmed_and_keeps_what_fitted(short_rig: Path, name: str) -> None:
    folder = short_rig.parent
    with served(read_rig(short_rig), bus_url="ws://127.0.0.1:0/") as (server, _):
        command = ["run", str(short_rig), "reversal", "--out", str(folder / name), "--pace", "fast"]
        addresses = ["--bus", server.bus_url, "--modbus", str(server.modbus)]
        done = subprocess.run(
            ["sh", "-c", LITTLE_ROOM, "sh", sys.executable, "-m", "hil", *command, *addresses],
            capture_output=True,
            text=True,
        )
        assert_disarmed(server.bus_url, 1, 2)
    assert done.returncode == 2, done.stderr
    assert f"{folder / name}: expected room for " in done.stderr
    assert "Traceback" not in done.stderr
    (kept,) = (*folder.glob("run*.csv"), *folder.glob("run.parquet"))
    samples = len(read_table(kept).columns["time_s"])
    assert f"{kept} holds the {samples} samples up to there" in done.stderr


@pytest.mark.parametrize("options", [[], campaign(["--json"])])
def test_standard_output_that_takes_nothing(options: list[str]) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "hil", "effects", *options], stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert done.returncode == 2
    assert done.stderr == "error: [Errno 28] No space left on device\n"


Spawn = Callable[..., subprocess.Popen[str]]


def others(than: signal.Signals) -> list[Any]:
    """Signals that are tried in the campaign: they are taken in one place, whichever comes."""
    ends = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
    return [pytest.param(each, marks=pytest.mark.campaign) for each in sorted(ends - {than})]


def opened_by(process: subprocess.Popen[str], pipe: Path) -> int:
    """Wait until a process opens a named pipe to read; give the end to write to."""
    while process.poll() is None:
        try:
            return os.open(pipe, os.O_WRONLY | os.O_NONBLOCK)
        except OSError:  # nobody reads yet, and shall have the processor to come to it
            time.sleep(0.01)
    raise AssertionError(process.communicate())


@pytest.mark.parametrize("number", [*others(signal.SIGHUP), signal.SIGHUP])
@pytest.mark.parametrize(
    "command",
    ["identify PIPE --out OUT", pytest.param("diagnose PIPE --model MODEL --out OUT", marks=pytest.mark.campaign)],
)
def test_while_it_reads(spawn: Spawn, drive: Path, command: str, number: signal.Signals) -> None:
    """The recording is a named pipe with nothing in it: the command is at it, and stays there."""
    pipe, out = drive / "pipe.csv", drive / "out"
    os.mkfifo(pipe)
    words = {"PIPE": str(pipe), "MODEL": str(drive / "drive.toml"), "OUT": str(out)}
    process = spawn(*(words.get(word, word) for word in command.split()))
    writing = opened_by(process, pipe)
    process.send_signal(number)
    printed, complaint = process.communicate(timeout=60)
    os.close(writing)
    assert (process.returncode, printed, complaint) == (130, "", "interrupted\n")
    assert not out.exists()


@pytest.mark.parametrize("number", [*others(signal.SIGINT), signal.SIGINT])
def test_while_it_computes(spawn: Spawn, drive: Path, number: signal.Signals) -> None:
    """The model is whole as soon as the pipe has been emptied and closed; the fit takes far longer."""
    pipe, out = drive / "pipe.toml", drive / "out"
    os.mkfifo(pipe)
    process = spawn("diagnose", str(drive / "run_1.csv"), "--model", str(pipe), "--out", str(out))
    writing = opened_by(process, pipe)
    os.write(writing, (drive / "drive.toml").read_bytes())
    os.close(writing)
    process.send_signal(number)
    printed, complaint = process.communicate(timeout=60)
    assert (process.returncode, printed, complaint) == (130, "", "interrupted\n")
    assert not out.exists()


def test_while_it_imports(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def interrupt(name: str) -> NoReturn:
        raise KeyboardInterrupt

    monkeypatch.setattr(importlib, "import_module", interrupt)
    assert run(["effects"]) == 130
    assert capsys.readouterr().err == "interrupted\n"
