"""The command line itself: common options, help and its examples, completion."""

import os
import re
import subprocess
import sys
from collections.abc import Iterable
from itertools import pairwise
from typing import Any

import pytest

from hil.cli.command_line import COMMANDS, Call, overview
from hil.cli.main import run
from hil.errors import UsageError
from tests.cli.command_lines import every_command, examples, parse


@pytest.mark.parametrize(
    "line",
    [
        "--quiet --log-level debug run rig.toml cruise",
        "run --quiet rig.toml --log-level debug cruise",
        "run rig.toml cruise --log-level=debug --quiet",
    ],
)
def test_common_options_stand_anywhere(line: str) -> None:
    assert Call.parse(line.split(), COMMANDS) == Call("run", ("rig.toml", "cruise"), True, "debug")


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("--log-level", "requires an argument"),
        ("effects --log-level", "requires an argument"),
        ("effect", "Did you mean 'effects'"),
        ("-q effects", "No such option: -q"),
    ],
)
def test_wrong_use_is_refused(line: str, said: str) -> None:
    with pytest.raises(UsageError, match=said):
        Call.parse(line.split(), COMMANDS)


def test_quiet_prints_nothing_but_what_json_prints(capsys: pytest.CaptureFixture[str], tmp_path: object) -> None:
    assert run(["export", "st", "--adaptive", "--out", f"{tmp_path}/a.st", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
    assert Call("diagnose", ("--json",), quiet=True).silent is False
    assert Call("diagnose", (), quiet=True).silent is True


@pytest.mark.parametrize("columns", [40, 80, 200])
def test_the_overview_fits_the_terminal(columns: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    text = overview(COMMANDS)
    assert max(map(len, text.splitlines())) <= columns
    assert all(f"  {name} " in text for name in COMMANDS)


def test_the_overview_imports_nothing_that_takes_time() -> None:
    program = (
        "import sys; from hil.cli.main import run; run(['--help']); "
        "print(sorted({'typer', 'rich', 'numpy', 'pydantic', 'logging', 'can'} & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"


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
    assert complete("hil ") >= {name for name in COMMANDS if " " not in name}
    assert complete("hil design damper --ta") == {"--target"}
    assert complete("hil --quiet re") == offered(COMMANDS, "re")
    assert complete("hil prove ma") == {"make"}


EVERY = list(every_command())


@pytest.mark.parametrize(("name", "command"), EVERY, ids=[name for name, _ in EVERY])
def test_every_help_has_an_example_of_its_command_that_parses(name: str, command: Any) -> None:
    lines = examples(command.epilog or "")
    assert any(line.split()[1 : 1 + len(name.split())] == name.split() for line in lines)
    for line in lines:
        parse(line)


@pytest.mark.parametrize("wrong", ["hil effects --colour", "hil export st", "hil rig paint", "hil nothing"])
def test_a_wrong_example_would_be_noticed(wrong: str) -> None:
    with pytest.raises(Exception, match=r"No such|Missing|unexpected|no such"):
        parse(wrong)


@pytest.mark.parametrize("name", [name for name, _ in EVERY])
def test_every_help_prints_its_example_and_flows(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*name.split(), "-h"]) == 0
    printed = capsys.readouterr().out
    assert f"Usage: hil {name}" in printed
    assert f"Example: hil {name}" in " ".join(printed.split())
    above_boxes = re.split(r"^╭", printed, maxsplit=1, flags=re.MULTILINE)[0]
    for line, following in pairwise(line.strip() for line in above_boxes.splitlines()):
        if line and following:  # a line is broken only where the next word has no room
            assert len(line) + 1 + len(following.split()[0]) > 78
    assert "…" not in above_boxes


@pytest.mark.parametrize(("name", "command"), EVERY, ids=[name for name, _ in EVERY])
def test_no_word_of_a_help_is_taken_for_markup(
    name: str, command: Any, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "2000")  # so that every text is on one line
    assert run([*name.split(), "--help"]) == 0
    printed = capsys.readouterr().out
    for parameter in command.params:
        assert (parameter.help or "").replace(r"\[", "[") in printed, f"{parameter.name}: a bracket is written \\["
