"""Options of every command here that runs many cases: how many at a time, and how long one may take."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Sequence


def add_work_options(parser: ArgumentParser, limit_s: float, what: str) -> None:
    """Add ``--jobs`` and ``--limit-s``; ``what`` names the pieces of work in the help."""
    parser.add_argument("--jobs", type=int, default=1, help=f"{what} at a time (default: %(default)s)")
    parser.add_argument(
        "--limit-s", type=float, default=limit_s, help="seconds one command may take (default: %(default)g)"
    )


def parse_work(parser: ArgumentParser, arguments: Sequence[str] | None) -> Namespace:
    """Parse a command line, and refuse less than one job."""
    options = parser.parse_args(arguments)
    if options.jobs < 1:
        parser.error(f"--jobs: expected 1 or more, got {options.jobs}")
    return options
