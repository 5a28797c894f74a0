"""The command line: carried out by the group of all commands, and one map to exit statuses.

Whatever takes time to import is imported inside the functions: Ctrl-C during it is an interruption like any
other, with its exit status and without a traceback.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Sequence
from enum import IntEnum

from hil.cli.command_line import COMMANDS, common_options, silence
from hil.errors import HilError, InputError
from hil.printable import shown
from hil.rig.stop import interrupt_on_signals


class ExitStatus(IntEnum):
    """Exit statuses of every command (CONTRACT: commands)."""

    DONE = 0
    BAD_INPUT = 2
    DEVICE_FAULT = 3
    REFUSED_BY_GUARD = 4
    INTERRUPTED = 130


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


def run(line: Sequence[str], keep_log: bool = False) -> int:
    """Run one command line."""
    try:
        return _run(line, keep_log)
    except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001 - the one place that maps errors to statuses
        return _report(error)


def _run(line: Sequence[str], keep_log: bool) -> int:
    from hil.cli.group import root
    from hil.cli.options import letting_go, use_cores_of_environment
    from hil.provenance import under
    from hil.support.command_log import level_of, logged

    own, silent, log_level = common_options(line)
    level = level_of(log_level) if keep_log and own and own[0] in COMMANDS else "off"
    with logged(own, level), silence(silent), under(own), letting_go():
        use_cores_of_environment()
        result = root(own, prog_name="hil", standalone_mode=False)
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
        message = error.format_message()
        is_help = message.startswith("Usage: ")  # of a group that was called without a command
        _complain(message if is_help else f"error: {message}{'' if message[-1] in '.?' else '.'}{_see_help(error)}")
        return int(error.exit_code)
    raise error


def _see_help(error: BaseException) -> str:
    context = getattr(error, "ctx", None)
    return "" if context is None else f" See: {context.command_path} --help"


def _complain(text: str) -> None:
    """Say what went wrong; where the terminal is gone nobody can be informed, and the exit status says it alone."""
    with contextlib.suppress(OSError):
        print(shown(text), file=sys.stderr, flush=True)  # noqa: T201 - the one place that speaks of errors


def main() -> None:
    """Entry point of the console script ``hil``."""
    interrupt_on_signals()
    status = run(sys.argv[1:], keep_log=True)
    # CPython remembers Ctrl-C inside an `exec` of a string (a dataclass that is being imported) and ends a program that
    # was started by `-m` by SIGINT in place of its status; the next string that is executed makes it forget.
    exec("")
    sys.exit(status)
