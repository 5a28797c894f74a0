"""Signals while a command works: status 130, no traceback, nothing half written, no drive left enabled."""

import importlib
import os
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import pytest

from hil.cli.main import run

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
