"""Places that can't be written to: refused before the work where that can be seen, and never half written."""

import ctypes
import importlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
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


IN_OPEN, IN_CLOSE_NOWRITE = 0x20, 0x10  # inotify(7)


@contextmanager
def watched(path: Path, event: int) -> Iterator[Callable[[subprocess.Popen[str]], None]]:
    """Give what waits until a process has opened a file, or has closed it again."""
    system = ctypes.CDLL(None)
    handle = system.inotify_init1(os.O_NONBLOCK)
    assert system.inotify_add_watch(handle, os.fsencode(path), event) >= 0

    def wait(process: subprocess.Popen[str]) -> None:
        while process.poll() is None:
            try:
                os.read(handle, 4096)
                return
            except BlockingIOError:  # not yet, and the process shall have the processor to come to it
                time.sleep(0.01)
        raise AssertionError(process.communicate())

    try:
        yield wait
    finally:
        os.close(handle)


@pytest.mark.skipif(sys.platform != "linux", reason="no inotify")
@pytest.mark.parametrize("number", [*others(signal.SIGHUP), signal.SIGHUP])
@pytest.mark.parametrize(
    ("command", "event"),
    [
        ("identify REC --out OUT", IN_OPEN),
        pytest.param("diagnose REC --model MODEL --out OUT", IN_OPEN, marks=pytest.mark.campaign),
        ("diagnose REC --model MODEL --out OUT", IN_CLOSE_NOWRITE),  # what it computes takes far longer
    ],
)
def test_while_it_reads_and_while_it_computes(
    spawn: Spawn, drive: Path, command: str, event: int, number: signal.Signals
) -> None:
    recording, out = drive / "run_1.csv", drive / "out"
    words = {"REC": str(recording), "MODEL": str(drive / "drive.toml"), "OUT": str(out)}
    with watched(recording, event) as wait:
        process = spawn(*(words.get(word, word) for word in command.split()))
        wait(process)
        process.send_signal(number)
        printed, complaint = process.communicate(timeout=60)
    assert (process.returncode, printed, complaint) == (130, "", "interrupted\n")
    assert not out.exists()


WITHIN_EXEC = """
import hil.cli.main as main

def interrupted(*_, **__):
    try:
        exec("raise KeyboardInterrupt")
    except KeyboardInterrupt:
        return 130

main.run = interrupted
main.main()
"""


def test_within_a_string_that_is_executed(tmp_path: Path) -> None:
    """As the definition of a dataclass does while its module is imported; seen with `-m` alone."""
    (tmp_path / "within_exec.py").write_text(WITHIN_EXEC, encoding="utf-8")
    path = os.pathsep.join([str(tmp_path), os.getcwd()])
    done = subprocess.run([sys.executable, "-m", "within_exec"], env={**os.environ, "PYTHONPATH": path})
    assert done.returncode == 130


def test_while_it_imports(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def interrupt(name: str) -> NoReturn:
        raise KeyboardInterrupt

    monkeypatch.setattr(importlib, "import_module", interrupt)
    assert run(["effects"]) == 130
    assert capsys.readouterr().err == "interrupted\n"
