"""The sealed cases on the scoreboard: a line each, with a link to the full report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from hil.proof.campaign.statistics import Row, quantiles
from hil.proof.prove.manifest import VERDICTS
from hil.proof.truth.specimen import PAIR_SIGN
from hil.report import page as html

HEADINGS = (
    "case",
    "hidden",
    "found",
    "outcome",
    "band (true) / Hz",
    "error before",
    "after",
    "noise",
    "fresh / noise",
    "report",
)


def cases_table(rows: Sequence[Row]) -> str:
    """Return the table of cases; the page stands next to the folder of verdicts."""
    return html.html_table(HEADINGS, [_case(row) for row in rows], numbers=(5, 6, 7, 8))


def _case(row: Row) -> list[str]:
    fit: Mapping[str, Any] = row.get("fit", {})
    errors = [_number(fit.get(name)) for name in ("retuned", "augmented", "noise_floor")]
    fresh = quantiles(row["fresh_over_floor"], (0.5,))[0]
    report = f'<a href="{VERDICTS}/{escape(row["case"])}/report.html">report</a>'
    mark = "✓" if row["success"] else "✗"
    return [
        _unbroken(row["case"]),
        escape(row["kind"]).replace(PAIR_SIGN, f"{PAIR_SIGN}<wbr>"),
        escape(_found(row)),
        _unbroken(f"{mark} {row['outcome']}"),
        _band(row),
        *errors,
        _number(fresh),
        report if "verdict" in row else escape(row["fault"] or ""),
    ]


def _found(row: Row) -> str:
    if "verdict" not in row:
        return "nothing: the command failed"
    return ", ".join(row["named"]) or str(row["verdict"]).replace("_", " ")


def _band(row: Row) -> str:
    """Return the band that was reported, whether it was right, and the true one; none where there is no mismatch."""
    band = row.get("band")
    if band is None:
        return "–"
    reported = _range(band["told_hz"])
    if "right" not in band:
        return _unbroken(f"{reported} (?)")
    mark, true = "✓" if band["right"] else "✗", _range(band["true_hz"])
    return _unbroken(f"{mark} {reported}") + " " + _unbroken(f"({true})")


def _range(band_hz: Sequence[float]) -> str:
    return f"{band_hz[0]:.1f}–{band_hz[1]:.1f}"


def _unbroken(text: str) -> str:
    return f'<span style="white-space: nowrap">{escape(text)}</span>'


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}"
