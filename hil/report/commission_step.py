"""One step of a commissioning in its report: how it ended, its findings, its runs, its earlier attempts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from types import MappingProxyType
from typing import Any

from hil.report import page as html
from hil.report.commission_figures import step_figures
from hil.report.numbers import moment

MARKS = MappingProxyType({True: ("no_mismatch", "✓ within"), False: ("unexplained", "✗ outside"), None: ("", "–")})
"""CSS class and words for within, outside, and no limit: the words tell, not the colour alone."""

STATUSES = MappingProxyType(
    {
        "done": ("explained", "done"),
        "skipped": ("", "skipped"),
        "blocked": ("unexplained", "blocked"),
        "interrupted": ("unexplained", "interrupted"),
        "running": ("", "under way"),
        "pending": ("", "to do"),
    }
)

STYLE = """<style>
table.findings td:nth-child(4) { white-space: nowrap; }
.findings .do { color: var(--soft); font-size: 0.92em; }
.findings tr.outside td:first-child { border-left: 4px solid #b34700; padding-left: 10px; }
.badge.small { font-size: 0.82rem; padding: 1px 10px; }
@media (max-width: 640px) {
  table.findings, table.findings tbody, table.findings tr, table.findings td { display: block; }
  table.findings thead { display: none; }
  table.findings tr { padding: 8px 0; border-bottom: 1px solid var(--line); }
  table.findings td { border: 0; padding: 1px 0; }
  table.findings td:first-child { font-weight: 600; min-width: 0; }
  table.findings td[data-label]:not(:first-child)::before { content: attr(data-label) ": "; color: var(--soft); }
}
</style>"""
"""Style of the findings, in addition to that of every page: on a narrow screen each becomes a small card."""

COLUMNS = ("what", "expected", "measured", "within?")


def step_section(name: str, title: str, record: Mapping[str, Any], folder_note: str = "") -> str:
    """Return the section of a step.

    Parameters
    ----------
    name, title
        Of the step.
    record
        As in the state file.
    folder_note
        A piece of HTML that belongs to it, such as a link.
    """
    pieces = [_status(record)]
    if record["findings"]:
        pieces.append(_findings(record["findings"]))
    pieces.append(folder_note)
    pieces += step_figures(name, record["evidence"])
    if record["runs"]:
        pieces.append(html.details(f"Runs ({len(record['runs'])}): predicted and measured", _runs(record["runs"])))
    if record["history"]:
        pieces.append(html.details(f"Earlier attempts ({len(record['history'])})", _history(record["history"])))
    return html.section(title, *(piece for piece in pieces if piece))


def badge(kind: str, words: str) -> str:
    """Return a small badge."""
    return f'<span class="badge small {kind}">{escape(words)}</span>'


def _status(record: Mapping[str, Any]) -> str:
    kind, words = STATUSES[record["status"]]
    because = f" because: {record['because']}" if record["because"] else ""
    when = f" {moment(record['ended_utc'])}" if record["ended_utc"] else ""
    attempt = f", attempt {record['attempt']}" if record["attempt"] > 1 else ""
    return f"<p>{badge(kind, words)} {escape(when + attempt + because)}</p>"


def card_table(columns: Sequence[str], rows: Sequence[str]) -> str:
    """Return a table whose rows are cards on a narrow screen; `card_row` makes them."""
    head = "".join(f"<th>{column}</th>" for column in columns)
    return f'<table class="findings"><thead><tr>{head}</tr></thead><tbody>{"".join(rows)}</tbody></table>'


def card_row(columns: Sequence[str], cells: Sequence[str], outside: bool) -> str:
    """Return a row of such a table; ``cells`` are HTML already, ``outside`` marks it."""
    inside = "".join(f'<td data-label="{label}">{cell}</td>' for label, cell in zip(columns, cells, strict=True))
    kind = ' class="outside"' if outside else ""
    return f"<tr{kind}>{inside}</tr>"


def _findings(findings: Sequence[Mapping[str, Any]]) -> str:
    return card_table(COLUMNS, [_finding(finding) for finding in findings])


def _finding(finding: Mapping[str, Any]) -> str:
    within = finding["within"]
    kind, words = MARKS[within]
    if within is None and finding["expected"] != "–":
        words = "? can't tell"
    do = f'<div class="do">→ {escape(finding["advice"])}</div>' if finding["advice"] and within is not True else ""
    verdict = badge(kind, words) if within is not None else escape(words)
    cells = (escape(finding["what"]), escape(finding["expected"]), escape(finding["measured"]) + do, verdict)
    return card_row(COLUMNS, cells, within is False)


def _runs(runs: Sequence[Mapping[str, Any]]) -> str:
    headings = ("run", "recording", "s", "m1 [Nm]", "predicted", "m2 [Nm]", "predicted", "speed [rad/s]", "predicted")
    rows = [
        (
            run["name"] + ("" if run["whole"] else " (ended early)"),
            run["recording"] or "none",
            f"{run['seconds']:.1f}",
            *_both(run, "torque_m1_nm", 0),
            *_both(run, "torque_m2_nm", 0),
            *_both(run, "speed_rad_s", 1),
        )
        for run in runs
    ]
    return html.table(headings, rows, numbers=range(2, len(headings)))


def _both(run: Mapping[str, Any], key: str, digits: int) -> Iterator[str]:
    for ranges in (run["measured"], run["predicted"]):
        yield f"{ranges[key][0]:z.{digits}f} … {ranges[key][1]:z.{digits}f}" if key in ranges else "–"


def _history(history: Sequence[Mapping[str, Any]]) -> str:
    rows = [
        (
            str(each["attempt"]),
            each["status"],
            moment(each["ended_utc"]) if each["ended_utc"] else "",
            each["because"],
            str(sum(finding["within"] is False for finding in each["findings"])),
            ", ".join(each["recordings"]),
        )
        for each in history
    ]
    return html.table(("attempt", "ended as", "at", "because", "outside", "recordings"), rows)
