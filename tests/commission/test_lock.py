"""A folder of a commissioning is held by one process at a time, and by none that has ended."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from hil.cli.main import run
from hil.commission.lock import LOCK, sole_use
from hil.errors import UsageError
from tests.cli.conftest import EXAMPLE

HOLDER = """
import sys
from pathlib import Path
from hil.commission.lock import sole_use
with sole_use(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def holder(folder: Path) -> subprocess.Popen[str]:
    """Start a process that holds a folder."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(folder)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "held\n"
    return process


def test_second_call_is_refused_by_name_of_the_first_and_leaves_everything(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = holder(tmp_path)
    try:
        nowhere = ("--bus", "ws://127.0.0.1:9/", "--modbus", "127.0.0.1:9")
        assert run(["commission", str(EXAMPLE), "--out", str(tmp_path), "--yes", *nowhere]) == 2
        assert f"got process {first.pid}." in capsys.readouterr().err
        assert [path.name for path in tmp_path.iterdir()] == [LOCK]
    finally:
        first.communicate("")


@pytest.mark.parametrize("killed", [False, True])
def test_folder_is_free_once_its_holder_has_ended_however_it_did(killed: bool, tmp_path: Path) -> None:
    first = holder(tmp_path)
    if killed:
        first.kill()
    first.communicate("" if not killed else None)
    with sole_use(tmp_path), pytest.raises(UsageError, match="expected no other call"), sole_use(tmp_path):
        pass
    with sole_use(tmp_path):
        assert (tmp_path / LOCK).exists()


def test_folder_that_takes_no_file_is_reported_by_name(tmp_path: Path) -> None:
    (tmp_path / LOCK).mkdir()
    with pytest.raises(UsageError, match=f"{LOCK}: expected a place to write to, got: "), sole_use(tmp_path):
        pass
