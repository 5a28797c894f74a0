"""Every command, those of groups included, shows in its help an example that the program would take."""

import re
from itertools import pairwise
from typing import Any

import pytest

from hil.cli.main import run
from tests.cli.command_lines import every_command, examples, parse

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
