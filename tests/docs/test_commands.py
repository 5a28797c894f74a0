"""Every command line that the documentation shows would be taken by the command it names."""

from __future__ import annotations

import pytest

from hil.cli.main import COMMANDS
from tests.cli.command_lines import command, parse
from tests.docs.pages import DOCS, ROOT, command_lines, mentioned_commands, pages

SHOWN = sorted({line for page in pages() for line in command_lines(page)})
MENTIONED = sorted({line for page in pages() for line in mentioned_commands(page)})


def options(name: str) -> set[str]:
    """Return the options of a command, those of its own commands included."""
    own = command(name)
    parts = (own, *getattr(own, "commands", {}).values())
    return {option for part in parts for parameter in part.params for option in parameter.opts} | {"--help"}


@pytest.mark.parametrize("line", SHOWN)
def test_a_shown_command_line_parses(line: str) -> None:
    parse(line)


@pytest.mark.parametrize("line", MENTIONED)
def test_a_mentioned_command_and_its_options_exist(line: str) -> None:
    _, name, *words = line.split()
    if name.startswith("-"):
        assert name in {"--help", "--version", "--quiet", "--log-level"}
        return
    assert name in COMMANDS
    assert {word for word in words if word.startswith("--")} <= options(name)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ("hil diagnos run.csv", "no such command"),
        ("hil run rig.toml cruise --oot x.csv", "No such option"),
        ("hil simulate --model m.toml", "Missing parameter"),
    ],
)
def test_a_wrong_command_line_is_noticed(wrong: str, said: str) -> None:
    with pytest.raises(Exception, match=said):
        parse(wrong)


def test_the_map_lists_every_command() -> None:
    text = (DOCS / "index.md").read_text(encoding="utf-8")
    assert [name for name in COMMANDS if f"| `hil {name}` |" not in text] == []


def test_command_lines_are_found_at_all() -> None:
    assert len(SHOWN) > 15
    assert len(MENTIONED) > 10
    assert any(line.startswith("hil diagnose") for line in command_lines(ROOT / "README.md"))
