"""The log that every command keeps: what a supporter reads in it, and that no command fails for it."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from hil.cli.main import run
from hil.support import command_log
from hil.support.command_log import log_file


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A state folder of this test's own, and the log at its default level."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.delenv("HIL_LOG")
    return tmp_path / "state"


def log() -> str:
    return log_file().read_text(encoding="utf-8")


def test_it_tells_command_version_and_end() -> None:
    assert run(["effects", "backlash"], keep_log=True) == 0
    lines = log().splitlines()
    assert [line.split(" INFO hil: ")[1].split()[0] for line in lines] == ["hil", "version", "ended"]
    assert "hil effects backlash" in lines[0]
    assert all(re.match(rf"\d{{4}}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{{3}}Z {os.getpid()} ", line) for line in lines)


def test_it_tells_the_error_with_its_place_in_the_program() -> None:
    assert run(["identify", "nowhere.csv", "--out", "out"], keep_log=True) == 2
    assert "ERROR hil: ended by RecordingError" in log()
    assert "Traceback" in log()


@pytest.mark.parametrize(("level", "reported"), [("error", False), ("warning", False), ("info", True), ("debug", True)])
def test_the_level_is_that_of_the_option(level: str, reported: bool) -> None:
    assert run(["--log-level", level, "effects"], keep_log=True) == 0
    assert ("hil effects" in log()) is reported


@pytest.mark.parametrize("where", ["option", "variable"])
def test_an_unknown_level_is_refused(
    where: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if where == "variable":
        monkeypatch.setenv("HIL_LOG", "loud")
    options = ["--log-level", "loud"] if where == "option" else []
    assert run([*options, "effects"], keep_log=True) == 2
    error = capsys.readouterr().err
    assert "expected one of debug, info, warning, error, off, got 'loud'" in error
    assert ("--log-level" if where == "option" else "HIL_LOG") in error


def test_nobody_else_can_read_it_and_it_holds_no_secret() -> None:
    log_file().parent.mkdir(parents=True)
    old = log_file().with_name("hil.log.1")
    for path in (log_file(), old):
        path.touch(mode=0o644)
    assert run(["effects", "--password", "hunter2", "wss://bert:hunter2@plc.example/"], keep_log=True) == 2
    for path in (log_file(), old):
        assert path.stat().st_mode & 0o077 == 0
    assert "hil effects --password" in log()
    assert "hunter2" not in log()
    assert "bert" not in log()


def test_it_rotates_and_keeps_a_few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command_log, "BYTES", 500)
    for _ in range(12):
        assert run(["effects", "backlash"], keep_log=True) == 0
    kept = sorted(log_file().parent.iterdir())
    assert [path.name for path in kept] == ["hil.log", *(f"hil.log.{n}" for n in range(1, command_log.KEPT + 1))]
    assert all(path.stat().st_size <= 500 for path in kept)


def test_the_console_script_keeps_it() -> None:
    done = subprocess.run([sys.executable, "-m", "hil", "effects", "backlash"], capture_output=True, check=True)
    assert done.returncode == 0
    assert "hil effects backlash" in log()
