"""One command line before any command is imported: taken apart, answered by the overview, or silenced.

The options that every command has may stand before the command or after it: ``hil --quiet run ...`` is
``hil run ... --quiet``. The overview is plain text, so that nothing has to be imported for it. Under ``--quiet`` there
are no tables and no progress; errors come on standard error all the same.
"""

from __future__ import annotations

import difflib
import os
import shutil
import textwrap
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass

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
    "fleet": "Diagnose or identify many recordings on Dask; a page of the fleet.",
}


def module_of(command: str) -> str:
    """Return the module that holds a command."""
    return f"hil.cli.{command.replace(' ', '_')}"


QUIET = "--quiet"
LOG_LEVEL = "--log-level"
HELP, SHORT_HELP = "--help", "-h"

SPEAKERS = frozenset(
    {"bugreport", "commission", "completion", "effects", "look", "model", "monitor", "rig", "runs", "sim", "solve"}
)
"""Commands that ask, or whose output is what they are called for: ``--quiet`` does not silence them."""


@dataclass(frozen=True, slots=True)
class Call:
    """What is to be done."""

    command: str
    arguments: tuple[str, ...] = ()  # the command's own
    quiet: bool = False  # only errors, and what ``--json`` prints
    log_level: str | None = None  # as given

    @classmethod
    def parse(cls, line: Sequence[str], commands: Collection[str]) -> Call:
        """Take a command line apart."""
        own, quiet, level = _common(line)
        if not own:
            return cls("", (), quiet, level)
        first = HELP if own[0] == SHORT_HELP else own[0]
        if first not in commands and first not in (HELP, "--version"):
            raise UsageError(_unknown(first, commands))
        if (both := " ".join(own[:2])) in commands and len(own) > 1:
            return cls(both, tuple(own[2:]), quiet, level)
        return cls(first, tuple(own[1:]), quiet, level)

    @property
    def silent(self) -> bool:
        """Whether nothing is to be printed but errors."""
        return self.quiet and "--json" not in self.arguments and self.command not in SPEAKERS


def _common(line: Sequence[str]) -> tuple[list[str], bool, str | None]:
    """Return a line without the options of every command, and what these said; after ``--`` nothing is an option."""
    own: list[str] = []
    quiet, level = False, None
    words = iter(line)
    for word in words:
        if word == "--":
            return [*own, word, *words], quiet, level
        if word == QUIET:
            quiet = True
        elif word == LOG_LEVEL or word.startswith(f"{LOG_LEVEL}="):
            level = word.partition("=")[2] or next(words, None)
            if level is None:
                raise UsageError(f"Option '{LOG_LEVEL}' requires an argument. See: hil --help")
        else:
            own.append(word)
    return own, quiet, level


def _unknown(word: str, commands: Collection[str]) -> str:
    if word.startswith("-"):
        return f"No such option: {word}. See: hil --help"
    close = difflib.get_close_matches(word, commands, n=1)
    guess = f" Did you mean '{close[0]}'?" if close else ""
    return f"No such command '{word}'.{guess} See: hil --help"


WIDEST = 100

OPTIONS = {
    "--help": "Show this and exit; after a command: its own help, with an example.",
    "--version": "Print the version and exit.",
    "--quiet": "Print errors only, and what --json prints. Before or after the command.",
    "--log-level LEVEL": "What the log keeps: debug, info, warning, error, off. Else by HIL_LOG, else info.",
}


def overview(commands: Mapping[str, str]) -> str:
    """Return the overview, as wide as the terminal allows."""
    width = min(shutil.get_terminal_size((80, 24)).columns, WIDEST)
    sections = [
        "Usage: hil [OPTIONS] COMMAND [ARGS]...",
        *_wrapped(("Identify a driveline over its fieldbus and name the physics its model lacks.",), width),
        "Commands:",
        *_rows(commands, width),
        "",
        "Options:",
        *_rows(OPTIONS, width),
        *_wrapped(("Start with: hil demo", "Example: hil run --help"), width),
    ]
    return "\n".join(sections) + "\n"


def _wrapped(lines: Iterable[str], width: int) -> Iterable[str]:
    return ("", *(textwrap.fill(line, width) for line in lines), "")


def _rows(rows: Mapping[str, str], width: int) -> Iterable[str]:
    column = max(map(len, rows)) + 4
    for name, text in rows.items():
        yield textwrap.fill(
            text,
            width,
            initial_indent=f"  {name}".ljust(column),
            subsequent_indent=" " * column,
            break_on_hyphens=False,
        )


NO_TERMINAL = "TTY_COMPATIBLE"
"""By this variable, at 0, the console library takes no stream for a terminal: it draws no progress."""


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
