"""``python -m hil.proof.campaign.sets DIR ... --out OUT``: what several opened sealed sets add up to.

A set of ``hil prove`` has a few dozen cases; the rates of single effects need more. From the ``scoreboard.json`` of
each ``DIR`` that was opened, ``OUT/summary.md``, ``OUT/summary.json`` and ``OUT/confusion.svg`` are written as a
campaign's are.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from hil.errors import RecordingError
from hil.files import read_json
from hil.proof.campaign.run import write_summary
from hil.proof.campaign.statistics import Row

SCOREBOARD = "scoreboard.json"


def read_sets(folders: Sequence[Path]) -> list[Row]:
    """Return the rows of several opened sets.

    Raises
    ------
    RecordingError
        If a folder has no scoreboard, or one without cases.
    """
    return [row for folder in folders for row in _rows(folder / SCOREBOARD)]


def _rows(path: Path) -> list[Row]:
    if not path.is_file():
        raise RecordingError(
            path, f"expected the scoreboard of an opened set, it is not there. hil prove open {path.parent}"
        )
    try:
        rows: list[Row] = read_json(path)["cases"]
    except (ValueError, KeyError, TypeError) as error:
        raise RecordingError(path, f"expected a scoreboard with its cases, got another file ({error}).") from error
    return rows


def main(arguments: Sequence[str] | None = None) -> int:
    """Add sets up; return the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m hil.proof.campaign.sets",
        description="Add several opened sets of sealed cases up.",
        epilog="Example: python -m hil.proof.campaign.sets out/prove707 out/prove708 --out out/sets",
    )
    parser.add_argument("sets", nargs="+", type=Path, metavar="DIR", help="folder of an opened set")
    parser.add_argument("--out", required=True, type=Path, help="folder for summary and confusion matrix")
    options = parser.parse_args(arguments)
    try:
        rows = read_sets(options.sets)
    except RecordingError as error:
        parser.error(str(error))
    options.out.mkdir(parents=True, exist_ok=True)
    write_summary(rows, options.out)
    sys.stdout.write(f"{options.out / 'summary.md'}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
