"""How a result was made: as the first line of a page, and as its last section."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from hil.provenance import Provenance
from hil.report import page as html
from hil.report.numbers import moment

MOST_NAMED = 4
"""Recordings that the first line names."""


def facts(made: Provenance | None) -> Iterator[tuple[str, str]]:
    """Return what a page is of, for its head: model, recordings, date."""
    if made is None:
        return
    names = [Path(each.file).name for each in made.recordings]
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    yield "rig", made.rig
    yield "model", ", ".join(Path(each.file).name for each in made.models)
    yield "recordings", ", ".join(names[:MOST_NAMED]) + more
    yield "date", moment(made.date)
    yield "program", made.program


def made_section(made: Provenance | None) -> html.Section | None:
    """Return program, date, command and the files with their checksums; None where nothing is known."""
    if made is None:
        return None
    rows = [("rig", made.rig)] if made.rig else []
    rows += [("program", made.program), ("date", made.date), ("command", made.command or "from Python")]
    for kind, sources in (("model", made.models), ("recording", made.recordings)):
        rows += [(kind, f"{each.file}, SHA-256 {each.sha256}") for each in sources]
    return html.section("How this was made", html.table(("", ""), rows))
