"""Command lines as the program would take them, without carrying them out."""

import importlib
import re
import shlex
from collections.abc import Iterator
from typing import Any

import typer

from hil.cli.command_line import COMMANDS, module_of


def command(name: str) -> Any:
    """Return the command (or group) of a name."""
    return typer.main.get_command(importlib.import_module(module_of(name)).app)


def every_command() -> Iterator[tuple[str, Any]]:
    """Yield each command with its name, those of groups as ``prove make``."""
    for name in COMMANDS:
        own = command(name)
        yield name, own
        for inner, each in getattr(own, "commands", {}).items():
            yield f"{name} {inner}", each


def parse(line: str) -> None:
    """Parse a whole command line; raises what the program would, and on an unknown command."""
    words = shlex.split(line, comments=True)
    _, name, *arguments = words[: words.index(">")] if ">" in words else words
    assert name in COMMANDS, f"no such command: {line}"
    if f"{name} {next(iter(arguments), None)}" in COMMANDS:
        name, arguments = f"{name} {arguments[0]}", arguments[1:]
    own = command(name)
    inner = getattr(own, "commands", {})
    if inner and arguments and not arguments[0].startswith("-"):
        assert arguments[0] in inner, f"no such command: {line}"
        own, arguments = inner[arguments[0]], arguments[1:]
    own.make_context(name, arguments)


def examples(epilog: str) -> list[str]:
    """Return the command lines of an epilog ``Example: hil ...``; more follow after ``: hil`` or ``; hil``."""
    text = " ".join(epilog.split())
    return [f"hil {part.strip()}" for part in re.split(r"(?:^Example|[.;][^.;:]*|;)\s*:?\s*\bhil ", text)[1:]]
