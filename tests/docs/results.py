"""Figures of the manual: each is a result file with its command and commit, and the pages are filled in from them.

``docs/results/NAME.toml`` holds what a campaign or benchmark printed (``text``), the ``command``, the ``commit`` that
it ran at, and the ``rooms`` that it measures. A page has a place for it:

    <!-- result: NAME -->
    ...
    <!-- end -->

``python -m tests.docs.results`` fills in all places. Where a room has changed since the commit, the page says so by
itself; a test fails where the page does not (`tests/docs/test_results.py`). To renew a figure, run its command, put
what it prints and the commit into the file, and fill in again.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from tests.docs.pages import DOCS, ROOT, pages

RESULTS = DOCS / "results"
PLACE = re.compile(r"<!-- result: (?P<name>[\w-]+) -->\n(?P<filled>.*?)<!-- end -->", re.S)


@dataclass(frozen=True, slots=True)
class Result:
    """What was measured: the text as it was printed, by which command, at which commit, and of which rooms."""

    name: str
    command: str  # empty where no program of this version makes it any more
    commit: str
    rooms: tuple[str, ...]  # folders whose code the figure depends on
    text: str  # Markdown
    totals: tuple[str, ...] = ()  # of a long table: "sum", "max" or "" for each column behind the first
    noted: bool = True  # False: the commit is the one that brought the figure into the manual; it was measured before

    @property
    def outdated(self) -> bool:
        """Whether a room has changed since; also where the program that measured has left."""
        return not self.command or bool(git("rev-list", "--max-count=1", f"{self.commit}..HEAD", "--", *self.rooms))

    @property
    def shown(self) -> str:
        """The text; of a long table its totals, and the rows with something in the last column: what was wrong."""
        if not self.totals:
            return self.text.strip()
        head, line, *rows = self.text.strip().splitlines()
        cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]
        columns = zip(self.totals, list(zip(*cells, strict=True))[1:], strict=True)
        total = " | ".join([f"all {len(rows)}", *(_total(how, column) for how, column in columns)])
        wrong = [row for row, own in zip(rows, cells, strict=True) if own[-1] != "0"]
        return "\n".join([head, line, f"| {total} |", *wrong])

    @property
    def filled(self) -> str:
        """Return what stands on a page: where it comes from, then the text."""
        by = f"`{self.command}`, " if self.command else "By a program that has left the project, "
        when = f"commit {self.commit}" if self.noted else f"in the manual since commit {self.commit}"
        old = f"; **older than {' and '.join(f'`{room}`' for room in self.rooms)}**" if self.outdated else ""
        rows = f"; each row is in `docs/results/{self.name}.toml`" if self.totals else ""
        return f"{by}{when}{old}{rows}:\n\n{self.shown}\n"


def _total(how: str, column: tuple[str, ...]) -> str:
    """Return the sum or the largest of a column's cells, as they are written."""
    return max(column, key=float) if how == "max" else str(sum(map(int, column))) if how == "sum" else ""


def git(*words: str) -> str:
    """Return what Git prints."""
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def has_history() -> bool:
    """Whether this is a checkout with all of its commits."""
    return (ROOT / ".git").exists() and git("rev-parse", "--is-shallow-repository") == "false"


@cache
def results() -> dict[str, Result]:
    """Return all result files."""
    return {path.stem: _read(path) for path in sorted(RESULTS.glob("*.toml"))}


def _read(path: Path) -> Result:
    content = tomllib.loads(path.read_text("utf-8"))
    return Result(
        path.stem, **{**content, "rooms": tuple(content["rooms"]), "totals": tuple(content.get("totals", ()))}
    )


def places(page: str) -> dict[str, str]:
    """Return what stands in the places of a page."""
    return {place["name"]: place["filled"] for place in PLACE.finditer(page)}


def with_results(page: str) -> str:
    """Return a page with its places filled in."""
    return PLACE.sub(
        lambda place: f"<!-- result: {place['name']} -->\n{results()[place['name']].filled}<!-- end -->", page
    )


def main() -> int:
    """Fill in the places of all pages."""
    for path in pages():
        text = path.read_text("utf-8")
        if (new := with_results(text)) != text:
            path.write_text(new, "utf-8")
            sys.stdout.write(f"{path.relative_to(ROOT)}: filled in\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
