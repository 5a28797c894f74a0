"""How a result was made, as the last section of a page."""

from __future__ import annotations

from hil.provenance import Provenance
from hil.report import page as html


def made_section(made: Provenance | None) -> str:
    """Return program, date, command and the files with their checksums; "" where nothing is known."""
    if made is None:
        return ""
    rows = [("program", f"hil {made.version}"), ("date", made.date), ("command", made.command or "from Python")]
    for kind, sources in (("model", made.models), ("recording", made.recordings)):
        rows += [(kind, f"{each.file}, SHA-256 {each.sha256}") for each in sources]
    return html.section("How this was made", html.table(("", ""), rows))
