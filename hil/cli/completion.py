"""``hil completion``: what a shell needs to complete the commands, by typer: each TAB asks hil itself.

The commands name here what is offered for their arguments: effects, and the experiments of a rig file.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from enum import Enum
from importlib.resources import files
from typing import Annotated

import typer
from typer.completion import get_completion_script  # type: ignore[attr-defined]

from drivers.foreign_file import read_regular_text
from hil.cli.printing import say

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


def effect_names(incomplete: str) -> Iterator[str]:
    """Yield the effects that begin so; from the text of their files, for importing them takes a second."""
    for file in (files("estimator") / "physics" / "effects").iterdir():
        if file.name.endswith(".py"):
            names = re.findall(r'^    name="(\w+)",$', file.read_text("utf-8"), re.MULTILINE)
            yield from (name for name in names if name.startswith(incomplete))


def experiment_names(ctx: typer.Context, incomplete: str) -> Iterator[str]:
    """Yield the experiments of the rig file on the line that begin so; none of a file that can't be read."""
    try:
        text = read_regular_text(ctx.params.get("rig") or "")
    except (OSError, UnicodeDecodeError):
        return
    for name in re.findall(r"^\s*\[experiments\.([^].]*)\]", text, re.MULTILINE):
        if name.startswith(incomplete):
            yield name
