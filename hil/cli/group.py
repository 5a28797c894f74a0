"""``hil`` itself: the group of all commands, each imported only where it is called."""

from __future__ import annotations

import importlib
import os
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from hil.cli.command_line import COMMANDS, module_of
from hil.cli.completion import VARIABLE
from hil.cli.printing import say
from hil.support.command_log import Level
from hil.version import __version__


class Commands(TyperGroup):
    """All commands with their lines of help; only the one on the line is imported."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.commands = {name: TyperCommand(name, short_help=line) for name, line in COMMANDS.items()}

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command on the line; where a shell asks, with the options that all have."""
        if (both := " ".join(args[:2])) in self.commands:  # ``hil design damper``
            args = [both, *args[2:]]
        name, known, rest = super().resolve_command(ctx, args)
        if name is None or known is None:
            return name, known, rest
        command: Any = typer.main.get_command(importlib.import_module(module_of(name)).app)
        for each in (command, *getattr(command, "commands", {}).values()):
            each.rich_markup_mode = None  # plain text: paragraphs flow, and a bracket is a bracket
            each.short_help = (each.help or "").partition("\n\n")[0]  # in full
        if ctx.resilient_parsing:
            command.params += [option for option in self.params if option.name in ("quiet", "log_level")]
        return name, command, rest


def _print_version(wanted: bool) -> None:
    if wanted:
        say(f"hil {__version__}")
        raise typer.Exit


root = typer.Typer(
    cls=Commands,
    add_completion=VARIABLE in os.environ,
    rich_markup_mode=None,
    no_args_is_help=True,
    context_settings={"help_option_names": ["--help", "-h"]},
)


@root.callback(epilog="Start with: hil demo. Example: hil run --help")
def everywhere(
    quiet: Annotated[
        bool, typer.Option("--quiet", help="Print errors only, and what --json prints. Before or after the command.")
    ] = False,
    log_level: Annotated[
        Level | None,
        typer.Option(
            metavar="LEVEL", help="What the log keeps: debug, info, warning, error, off. Else by HIL_LOG, else info."
        ),
    ] = None,
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, help="Print the version and exit.")
    ] = False,
) -> None:
    """Identify a driveline over its fieldbus and name the physics its model lacks."""
