"""The command line itself: common options, help and its examples, completion."""

import os
import subprocess
import sys
from collections.abc import Iterable
from typing import Any

import pytest

from hil.cli.command_line import COMMANDS, common_options
from hil.cli.main import run
from hil.errors import UsageError
from tests.cli.command_lines import every_command, examples, parse


@pytest.mark.parametrize(
    "line",
    [
        "--quiet --log-level debug run rig.toml cruise -- --quiet",
        "run --quiet rig.toml --log-level debug cruise -- --quiet",
        "run rig.toml cruise --log-level=debug --quiet -- --quiet",
    ],
)
def test_common_options_stand_anywhere(line: str) -> None:
    assert common_options(line.split()) == (["run", "rig.toml", "cruise", "--", "--quiet"], True, "debug")


@pytest.mark.parametrize("line", ["--log-level", "effects --log-level"])
def test_a_level_that_is_missing_is_refused(line: str) -> None:
    with pytest.raises(UsageError, match="--log-level: expected one argument"):
        common_options(line.split())


def test_quiet_prints_nothing_but_what_json_prints(capsys: pytest.CaptureFixture[str], tmp_path: object) -> None:
    assert run(["export", "st", "--adaptive", "--out", f"{tmp_path}/a.st", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
    lines = ("diagnose --quiet", "diagnose --json --quiet", "runs --quiet")
    assert [common_options(line.split())[1] for line in lines] == [True, False, False]


@pytest.mark.parametrize("asked", [[], ["--help"], ["-h"]])
def test_the_overview_has_every_command_in_full(asked: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(asked) == (0 if asked else 2)
    printed = " ".join("".join(capsys.readouterr()).split())
    assert all(f" {name} {line}" in printed for name, line in COMMANDS.items())


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
def test_every_help_prints_its_example(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*name.split(), "-h"]) == 0
    printed = capsys.readouterr().out
    assert f"Usage: hil {name}" in printed
    assert f"Example: hil {name}" in " ".join(printed.split())
