"""``hil completion``: what a shell needs to complete the commands, by typer: each TAB asks hil itself.

The commands name here what is offered for their arguments: effects, and the experiments of a rig file.
"""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterator
from enum import Enum
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.completion import get_completion_script  # type: ignore[attr-defined]
from typer.core import TyperCommand, TyperGroup

from hil.cli.command_line import COMMANDS, module_of
from hil.cli.printing import say
from hil.support.command_log import Level

app = typer.Typer(add_completion=False)

VARIABLE = "_HIL_COMPLETE"
"""By this variable a shell asks what can stand where the cursor is; the command line is not carried out."""


class Shell(Enum):
    """The shells there is a script for."""

    BASH = "bash"
    ZSH = "zsh"
    FISH = "fish"


@app.command(epilog="Example: hil completion bash > ~/.local/share/bash-completion/completions/hil")
def completion(shell: Annotated[Shell, typer.Argument(metavar="SHELL", help="bash, zsh or fish.")]) -> None:
    """Print the completion script of a shell: commands, options, experiments of a rig file, effects, files."""
    say(get_completion_script(prog_name="hil", complete_var=VARIABLE, shell=shell.value))


class Commands(TyperGroup):
    """All commands with their lines of help; only the one on the line is imported."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return their names."""
        return [name for name in COMMANDS if " " not in name]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return what is shown of a command in a list."""
        return TyperCommand(cmd_name, help=COMMANDS[cmd_name])

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command on the line, with the options that all have."""
        name, *rest = args
        if name not in self.list_commands(ctx):
            return None, None, []
        if rest and f"{name} {rest[0]}" in COMMANDS:
            name, rest = f"{name} {rest[0]}", rest[1:]
        command = typer.main.get_command(importlib.import_module(module_of(name)).app)
        command.params += [option for option in self.params if option.name in ("quiet", "log_level")]
        return name, command, rest


root = typer.Typer(cls=Commands, add_completion=True)


@root.callback()
def everywhere(
    quiet: Annotated[bool, typer.Option("--quiet", help="Print errors only.")] = False,
    log_level: Annotated[Level | None, typer.Option(help="What the log keeps.")] = None,
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    """Stand for ``hil`` where a shell asks."""


def complete() -> None:
    """Answer the shell that asks by `VARIABLE`, and end."""
    root(prog_name="hil")


def effect_names(incomplete: str) -> Iterator[str]:
    """Yield the effects that begin so; from the text of their files, for importing them takes a second."""
    for file in (files("estimator") / "physics" / "effects").iterdir():
        if file.name.endswith(".py"):
            names = re.findall(r'^    name="(\w+)",$', file.read_text("utf-8"), re.MULTILINE)
            yield from (name for name in names if name.startswith(incomplete))


def experiment_names(ctx: typer.Context, incomplete: str) -> Iterator[str]:
    """Yield the experiments of the rig file on the line that begin so; none of a file that can't be read."""
    try:
        text = Path(ctx.params.get("rig") or "").read_text("utf-8")
    except (OSError, UnicodeDecodeError):
        return
    for name in re.findall(r"^\s*\[experiments\.([^].]*)\]", text, re.MULTILINE):
        if name.startswith(incomplete):
            yield name
