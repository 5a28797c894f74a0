"""What ``hil --help`` prints: plain text, so that nothing has to be imported for it."""

from __future__ import annotations

import shutil
import textwrap
from collections.abc import Iterable, Mapping

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
