"""``hil completion``: what a shell needs to complete the commands."""

from __future__ import annotations

from enum import Enum
from typing import Annotated

import typer

app = typer.Typer(add_completion=False)


class Shell(Enum):
    """The shells there is a script for."""

    BASH = "bash"
    ZSH = "zsh"
    FISH = "fish"


@app.command(epilog="Example: hil completion bash > ~/.local/share/bash-completion/completions/hil")
def completion(shell: Annotated[Shell, typer.Argument(metavar="SHELL", help="bash, zsh or fish.")]) -> None:
    """Print the completion script of a shell: commands, options, experiments of a rig file, effects, files.

    The first lines of the script say where to put it. Print it anew after an update of hil.
    """
    from estimator.physics.catalogue import EFFECTS
    from hil.cli.main import COMMANDS
    from hil.support.completion import script

    typer.echo(script(shell.value, COMMANDS, EFFECTS), nl=False)
