"""The command line as `tests/cli` has it, and one way to say that a command was refused."""

from collections.abc import Callable
from pathlib import Path

import pytest

from hil.cli.main import run
from tests.cli import bench
from tests.cli.conftest import EXAMPLE, short_rig, simulate, spawn

__all__ = ["short_rig", "simulate", "spawn"]

Refused = Callable[..., str]
"""``refused(*arguments, status=2)``: run a command that must fail; give what it said."""


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str]) -> Refused:
    """Run a command that must be refused with one complaint, and with nothing printed as if it had worked."""

    def check(*arguments: object, status: int = 2) -> str:
        assert run([str(word) for word in arguments]) == status
        printed = capsys.readouterr()
        assert printed.out == ""
        notes, word, complaint = printed.err.rpartition("error: ")
        assert word
        assert all(line.startswith("note: ") for line in notes.splitlines())
        assert "Traceback" not in complaint
        return word + complaint

    return check


@pytest.fixture
def rig_text() -> str:
    return EXAMPLE.read_text(encoding="utf-8")


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """A folder with a good recording ``run_1.csv`` and its model ``drive.toml``."""
    folder = tmp_path / "drive"
    folder.mkdir()
    bench.record(folder / "run_1.csv", 1, noise=0.02)
    bench.model(folder / "drive.toml")
    return folder
