"""``hil completion``: what a shell is offered, asked as typer's scripts ask, and by bash itself."""

import os
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import pytest

from hil.cli.command_line import COMMANDS
from hil.cli.main import run

RIG = Path(__file__).resolve().parents[2] / "examples" / "rig.toml"


def complete(line: str) -> set[str]:
    """Return what stands for the last word of a line."""
    asked = {"_HIL_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(len(line.split(" ")) - 1)}
    program = "from hil.cli.main import main; main()"
    done = subprocess.run(
        [sys.executable, "-P", "-c", program], env={**os.environ, **asked}, capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    return set(done.stdout.split())


def offered(found: Iterable[str], begun: str) -> set[str]:
    return {name for name in found if name.startswith(begun)}


def test_commands() -> None:
    assert complete("hil ") >= set(COMMANDS)
    assert complete("hil --quiet re") == offered(COMMANDS, "re")
    assert complete("hil prove ma") == {"make"}


def test_experiments_of_the_rig_file_on_the_line(tmp_path: Path) -> None:
    assert {"cruise", "reversal", "tip"} <= complete(f"hil run {RIG} ")
    assert complete(f"hil run --pace fast {RIG} re") == {"reversal"}
    assert complete(f"hil run {tmp_path / 'none.toml'} re") == set()


@pytest.mark.parametrize(("shell", "word"), [("zsh", "compdef"), ("fish", "complete --command hil")])
def test_other_shells_have_a_script(shell: str, word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["completion", shell]) == 0
    assert word in capsys.readouterr().out
