"""What is known of a command line before any command is imported: the commands, and what may stand anywhere in it.

The options that every command has may stand before the command or after it: ``hil --quiet run ...`` is
``hil run ... --quiet``. Under ``--quiet`` there are no tables and no progress; errors come on standard error all the
same.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout

from hil.errors import UsageError

COMMANDS: dict[str, str] = {
    "demo": "The whole job with nothing connected: sealed effect, verdict, seal opened.",
    "prove": "The proof: sealed cases, answered and opened, with a scoreboard.",
    "sim": "Serve the simulated slaves: two inverters, PLC, driveline.",
    "check": "Find every device, compare it with rig file and EDS; commands no torque.",
    "commission": "Lead through commissioning: checks, experiments, models, report.",
    "run": "Run one experiment and record it.",
    "monitor": "Watch a rig live; start, mark and stop experiments.",
    "replay": "Play a recording or a bus trace through the on-line estimate.",
    "look": "What is in a recording, and the table that reads it.",
    "convert": "Between the recording formats, and from bus traces.",
    "runs": "The runs of a folder: list, show, compare, note, delete, export.",
    "identify": "Identify the driveline from recordings.",
    "fleet": "Diagnose or identify many recordings on Dask; a page of the fleet.",
    "paper": "The paper's figures from eight experiments on the simulated rig, or from recordings.",
    "diagnose": "Locate the mismatch and name the missing physics.",
    "design": "The next experiment that would decide what is left open.",
    "design damper": "A feedback from speed to torque that damps the resonance.",
    "solve": "Diagnose, design, drive, diagnose again, until it is decided.",
    "simulate": "Free-run simulation from the measured torques.",
    "compare": "Simulation against recording, in figures and plots.",
    "effects": "The catalogue of effects.",
    "rig": "Write a new rig file from a few answers; its schema for editors.",
    "model": "Write a new model file; the schema of model files for editors.",
    "completion": "Print the completion script of a shell.",
    "bugreport": "Pack what a supporter needs, without secrets.",
    "export": "Write the on-line estimator for a PLC, or the driveline as an FMU.",
}

NEVER_QUIET = frozenset(
    {"bugreport", "commission", "completion", "effects", "look", "model", "monitor", "rig", "runs", "sim", "solve"}
)
"""Commands that ask, or whose output is what they are called for: ``--quiet`` does not silence them."""

NO_TERMINAL = "TTY_COMPATIBLE"
"""By this variable, at 0, the console library takes no stream for a terminal: it draws no progress."""


def module_of(command: str) -> str:
    """Return the module that holds a command."""
    return f"hil.cli.{command.replace(' ', '_')}"


def common_options(line: Sequence[str]) -> tuple[list[str], bool, str | None]:
    """Take the options of every command out of a line: what is left, whether it is silent, the level of the log."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False, exit_on_error=False)
    parser.add_argument("--quiet", action="store_true")
    parser.add_argument("--log-level")
    try:
        common, own = parser.parse_known_args(line)
    except argparse.ArgumentError as error:
        raise UsageError(f"{error}. See: hil --help") from error
    silent = common.quiet and "--json" not in own and not NEVER_QUIET.intersection(own[:1])
    return own, silent, common.log_level


def is_silent() -> bool:
    """Tell whether nothing is to be printed but errors."""
    return os.environ.get(NO_TERMINAL) == "0"


@contextmanager
def silence(wanted: bool) -> Iterator[None]:
    """Print nothing on standard output, and draw nothing, for the time of the block; do nothing if not wanted."""
    if not wanted:
        yield
        return
    before = os.environ.get(NO_TERMINAL)
    os.environ[NO_TERMINAL] = "0"
    try:
        with open(os.devnull, "w", encoding="utf-8") as nowhere, redirect_stdout(nowhere):
            yield
    finally:
        if before is None:
            del os.environ[NO_TERMINAL]
        else:
            os.environ[NO_TERMINAL] = before
