"""The scoreboard's part on sealed rigs: where something was concealed, what the tool found over the wire."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hil.proof.campaign.statistics import Row
from hil.report import page as html

HEADINGS = ("rig", "concealed in", "found", "outcome", "error before", "after", "noise", "report")


def wire_section(rows: Sequence[Row], folder: str) -> html.Section:
    """Return the section; ``folder`` is where the rigs' folders are, seen from the page."""
    right = sum(bool(row["success"]) for row in rows)
    title = f"Over the wire: {right} of {len(rows)}"
    sentence = (
        "The effect sits in simulated slaves served by a process of its own; the tool has CANopen and Modbus, runs its "
        "own tests, and the seal is opened once its verdict is written."
    )
    table = html.table(HEADINGS, [_cells(row, folder) for row in rows], numbers=(4, 5, 6))
    return html.section(title, html.paragraph(sentence), table)


def _cells(row: Row, folder: str) -> list[Any]:
    fit = row.get("fit", {})
    errors = [_number(fit.get(name)) for name in ("retuned", "augmented", "noise_floor")]
    mark = "✓" if row["success"] else "✗"
    name = row["case"]
    report = html.Link("report", f"{folder}/{name}/report.html") if "verdict" in row else ""
    return [name, row["where"], _found(row), f"{mark} {row['outcome']}", *errors, report]


def _found(row: Row) -> str:
    if "verdict" not in row:
        return str(row["said"]) or "nothing: the command failed"
    return ", ".join(row["named"]) or str(row["verdict"]).replace("_", " ")


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}"
