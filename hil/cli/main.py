"""The command line: one table of commands, each imported only when called, and one map to exit statuses.

Whatever takes time to import is imported inside the functions: Ctrl-C during it is an interruption like any
other, with its exit status and without a traceback.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Sequence
from enum import IntEnum
from typing import TYPE_CHECKING

from hil import __version__
from hil.errors import HilError, InputError
from hil.rig.stop import interrupt_on_signals

if TYPE_CHECKING:
    import typer


class ExitStatus(IntEnum):
    """Exit statuses of every command (CONTRACT: commands)."""

    DONE = 0
    BAD_INPUT = 2
    DEVICE_FAULT = 3
    REFUSED_BY_GUARD = 4
    INTERRUPTED = 130


COMMANDS: dict[str, str] = {
    "demo": "The whole job with nothing connected: sealed effect, verdict, seal opened.",
    "prove": "The proof: sealed cases, answered and opened, with a scoreboard.",
    "sim": "Serve the simulated slaves: two inverters, PLC, driveline.",
    "check": "Find every device, compare it with rig file and EDS; commands no torque.",
    "run": "Run one experiment and record it.",
    "replay": "Rebuild the samples of a run from its bus trace.",
    "identify": "Identify the driveline from recordings.",
    "diagnose": "Locate the mismatch and name the missing physics.",
    "simulate": "Free-run simulation from the measured torques.",
    "compare": "Simulation against recording, in figures and plots.",
    "effects": "The catalogue of effects.",
}
"""Each command's line in ``hil --help``; the command itself is ``app`` in ``hil.cli.<name>``."""


def _overview() -> typer.Typer:
    """Build the group that prints help and refuses unknown names, without importing any command."""
    import typer

    app = typer.Typer(
        no_args_is_help=True,
        add_completion=False,
        help="Identify a driveline over its fieldbus and name the physics its model left out.",
        epilog="Start with: hil demo. Each command has --help with an example.",
    )

    @app.callback(invoke_without_command=True)
    def version(
        version: bool = typer.Option(False, "--version", help="Print the version and exit."),
    ) -> None:
        if version:
            typer.echo(f"hil {__version__}")
            raise typer.Exit

    for name, line in COMMANDS.items():
        app.command(name, help=line)(lambda: None)
    return app


def _application(arguments: Sequence[str]) -> tuple[Callable[..., object], list[str], str]:
    """Choose what runs: the named command's own application, or the overview."""
    if arguments and arguments[0] in COMMANDS:
        name = arguments[0]
        return importlib.import_module(f"hil.cli.{name}").app, list(arguments[1:]), f"hil {name}"
    return _overview(), list(arguments), "hil"


def exit_status(error: BaseException) -> ExitStatus | None:
    """Map an error to its exit status; None for one that is a defect of this program."""
    from drivers.errors import CommandRefused, DriverError
    from estimator.errors import EstimatorError

    families: tuple[tuple[type[BaseException], ExitStatus], ...] = (
        (KeyboardInterrupt, ExitStatus.INTERRUPTED),
        (CommandRefused, ExitStatus.REFUSED_BY_GUARD),
        (DriverError, ExitStatus.DEVICE_FAULT),
        (InputError, ExitStatus.BAD_INPUT),
        (EstimatorError, ExitStatus.BAD_INPUT),
        (HilError, ExitStatus.DEVICE_FAULT),
        (OSError, ExitStatus.BAD_INPUT),  # the drivers' own are above: what is left is a file or a full disk
    )
    return next((status for family, status in families if isinstance(error, family)), None)


def run(arguments: Sequence[str]) -> int:
    """Run one command line.

    Returns
    -------
    int
        The exit status; one line of cause and cure is on standard error where it is not 0. An error that is
        none of ours is a defect and is raised with its traceback.
    """
    try:
        return _run(arguments)
    except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001 - the one place that maps errors to statuses
        return _report(error)


def _run(arguments: Sequence[str]) -> int:
    app, rest, name = _application(arguments)
    result = app(rest, prog_name=name, standalone_mode=False)
    if result == ExitStatus.INTERRUPTED:  # what typer makes of Ctrl-C
        raise KeyboardInterrupt
    return result if isinstance(result, int) else ExitStatus.DONE


def _report(error: BaseException) -> int:
    status = exit_status(error)
    if status is not None:
        notes = " ".join(("", *getattr(error, "__notes__", ())))
        _complain(("interrupted" if isinstance(error, KeyboardInterrupt) else f"error: {error}") + notes)
        return status
    if hasattr(error, "format_message") and hasattr(error, "exit_code"):  # typer's own usage errors
        if message := error.format_message():  # empty where typer printed the help instead
            _complain(f"error: {message}{'' if message[-1] in '.?' else '.'}{_see_help(error)}")
        return int(error.exit_code)
    raise error


def _see_help(error: BaseException) -> str:
    context = getattr(error, "ctx", None)
    return "" if context is None else f" See: {context.command_path} --help"


def _complain(text: str) -> None:
    print(text, file=sys.stderr)  # noqa: T201 - the one place that speaks of errors


def main() -> None:
    """Entry point of the console script ``hil``."""
    interrupt_on_signals()
    sys.exit(run(sys.argv[1:]))
