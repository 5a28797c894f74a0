"""Every command line that the documentation shows would be taken by the command it names."""

import pytest

from hil.cli.command_line import COMMANDS
from hil.cli.main import ExitStatus
from tests.cli.command_lines import command, parse
from tests.docs import commands_page
from tests.docs.pages import ROOT, command_lines, mentioned_commands, pages

SHOWN = sorted({line for page in pages() for line in command_lines(page)})
CURE = "run: python -m tests.docs.commands_page"
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
    if f"{name} {next(iter(words), None)}" in COMMANDS:
        name, words = f"{name} {words[0]}", words[1:]
    assert {word for word in words if word.startswith("--")} <= options(name)
    inner = getattr(command(name), "commands", {})
    assert not (inner and words) or words[0] in inner or words[0].startswith("-"), f"no such command: {line}"


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


def test_the_reference_is_what_the_commands_say() -> None:
    assert commands_page.PAGE.read_text(encoding="utf-8") == commands_page.page(), CURE


def test_the_reference_has_every_option() -> None:
    text = commands_page.PAGE.read_text(encoding="utf-8")
    declared = {option for name in COMMANDS for option in options(name) if option.startswith("--")}
    assert {option for option in declared if f"`{option}" not in text} == set()
    assert set(commands_page.STATUSES) == set(ExitStatus)


def test_command_lines_are_found_at_all() -> None:
    assert len(SHOWN) > 15
    assert len(MENTIONED) > 10
    assert any(line.startswith("hil diagnose") for line in command_lines(ROOT / "README.md"))
