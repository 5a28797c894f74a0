"""The scoreboard: what was concealed, what was found, how much better the fit became; every miss. HTML and JSON."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil.proof.kinds import Group
from hil.proof.score import Rate, Row, coverage, outcomes, quantiles, share
from hil.proof.sealed_set import VERDICTS
from hil.proof.truth.specimen import PAIR_SIGN
from hil.provenance import Provenance
from hil.report import page as html
from hil.report.made import made_section

SCHEMA = "hil.scoreboard/1"
PAGE, DATA = "scoreboard.html", "scoreboard.json"
WIRE, REAL = "wire", "real"  # folders next to the page
FALSE_CLAIMS = ("false_claim", "wrong", "invented")  # outcomes in which something was named that is not there

FOOTER = (
    "hil prove. What was hidden was drawn by a simulator that shares no code with the model that is fitted, and sealed "
    "before the public command saw the recordings. Intervals of rates are Wilson's, 95 %."
)

GROUPS = {
    Group.SINGLE: ("one effect of the catalogue", "it is named, and nothing else"),
    Group.PAIR: ("two effects", "both are named, and nothing else"),
    Group.NONE: ("nothing hidden, nominal values right", "no mismatch"),
    Group.OFF: ("nothing hidden, nominal values off", "no mismatch"),
    Group.OUTSIDE: ("an effect no entry describes", "a mismatch, and no name"),
}
"""What is hidden, and what the right verdict is."""

CASE_HEADINGS = ("case", "hidden", "found", "outcome", "error before", "after", "noise", "fresh / noise", "report")
RIG_HEADINGS = ("rig", "concealed in", "found", "outcome", "error before", "after", "noise", "report")
REAL_HEADINGS = ("recording", "found", "held-out error before", "after", "report")
AGREEMENTS = ("besides what is known", "found", "known", "95 % interval", "asked")


@dataclass(frozen=True, slots=True)
class Board:
    """Everything the scoreboard shows."""

    sealed: Sequence[Row]  # rows of `hil.proof.answers.judge_set`
    wire: Sequence[Row] = ()  # rows of `hil.proof.rigs.run_wire`
    real: Sequence[Mapping[str, Any]] = ()  # cases of ``real.json`` (`hil.proof.real`)
    made: Provenance | None = None  # model files and recordings of the sealed cases


def scoreboard_files(board: Board) -> dict[str, Callable[[Path], object]]:
    """Return what writes the scoreboard, by file name; it stands next to the folders verdicts, wire and real."""
    data = json.dumps(scoreboard_json(board), indent=1, allow_nan=False) + "\n"
    text = scoreboard_page(board)
    return {
        DATA: lambda to: to.write_text(data, encoding="utf-8"),
        PAGE: lambda to: to.write_text(text, encoding="utf-8"),
    }


def scoreboard_json(board: Board) -> dict[str, Any]:
    """Return the scoreboard for scripts; JSON types only."""
    rows = board.sealed
    return {
        "schema": SCHEMA,
        "summary": _summary(rows),
        "false_claims": _rate(rows, FALSE_CLAIMS).as_json(),
        "cases": [dict(row) for row in rows],
        "wire": [dict(row) for row in board.wire],
        "real": [dict(case) for case in board.real],
        "made": None if board.made is None else board.made.document(),
    }


def _summary(rows: Sequence[Row]) -> dict[str, Any]:
    return {
        "cases": len(rows),
        "groups": {group: _figures(members) for group, members in _by("group", rows).items()},
        "kinds": {kind: _figures(members) for kind, members in _by("kind", rows).items()},
        "confusion": {kind: dict(counts) for kind, counts in _confusion(rows).items()},
        "coverage": {what: rate.as_json() for what, rate in coverage(rows).items()},
        "diagnose_s": dict(zip(("median", "p90", "max"), quantiles(row["diagnose_s"] for row in rows), strict=True)),
    }


def _figures(rows: Sequence[Row]) -> dict[str, Any]:
    ious = [iou for row in rows for iou in row.get("event_iou", {}).values()]
    return {
        "success": share(row["success"] for row in rows).as_json(),
        "outcomes": outcomes(rows),
        "element": _located(rows).as_json(),
        "event_iou_median": quantiles(ious, (0.5,))[0],
        "fresh_over_floor_median": quantiles((value for row in rows for value in row["fresh_over_floor"]), (0.5,))[0],
    }


def _by(key: str, rows: Sequence[Row]) -> dict[str, list[Row]]:
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(row[key], []).append(row)
    return groups


def _confusion(rows: Sequence[Row]) -> dict[str, Counter[str]]:
    """Count what was named first, by what was hidden; pairs are left out."""
    single = [row for row in rows if row["group"] != Group.PAIR.value]
    return {kind: Counter(_found(row).split(", ")[0] for row in group) for kind, group in _by("kind", single).items()}


def _located(rows: Sequence[Row]) -> Rate:
    return share(row["element_right"] for row in rows if row.get("element_right") is not None)


def scoreboard_page(board: Board) -> str:
    """Return the page: figures first, misses next, then rigs, real recordings and every sealed case."""
    rows = board.sealed
    misses = [row for row in rows if not row["success"]]
    title = f"{len(rows) - len(misses)} of {len(rows)} sealed cases answered as they should be"
    sections = [
        html.header(title, html.tiles(_tiles(rows))),
        html.section("By what was hidden", _groups(rows)),
        html.section("Misses", _cases(misses) if misses else html.paragraph("None.")),
        *([_wire_section(board.wire)] if board.wire else []),
        *([_real_section(board.real)] if board.real else []),
        html.section("What was named", html.table(("hidden", "named first"), _named(rows))),
        html.section("Every case", _cases(rows)),
        made_section(board.made),
    ]
    return html.page("Scoreboard", sections, FOOTER)


def _tiles(rows: Sequence[Row]) -> list[tuple[str, str, str]]:
    sizes = coverage(rows).values()
    held = Rate(sum(rate.hits for rate in sizes), sum(rate.trials for rate in sizes))
    fresh = quantiles((value for row in rows for value in row["fresh_over_floor"]), (0.5,))[0]
    rates = {
        "as it should be": share(row["success"] for row in rows),
        "something named that is not there": _rate(rows, FALSE_CLAIMS),
        "right element": _located(rows),
    }
    return [
        *((what, _percent(rate), _interval(rate)) for what, rate in rates.items()),
        ("95 % intervals that hold the truth", _percent(held), f"of {held.trials}"),
        ("error on fresh recordings", "–" if fresh is None else f"{fresh:.3g} ×", "the sensor's noise, median"),
    ]


def _groups(rows: Sequence[Row]) -> html.HtmlTable:
    lines = []
    for group, (title, wanted) in GROUPS.items():
        members = [row for row in rows if row["group"] == group.value]
        if members:
            rate = share(row["success"] for row in members)
            lines.append((title, wanted, f"{rate.hits} of {rate.trials}", _percent(rate), _interval(rate)))
    return html.table(("hidden", "wanted", "cases", "rate", "interval"), lines, numbers=(2, 3))


def _named(rows: Sequence[Row]) -> list[tuple[str, str]]:
    return [
        (kind, ", ".join(f"{name} {count}" for name, count in counts.most_common()))
        for kind, counts in _confusion(rows).items()
    ]


def _cases(rows: Sequence[Row]) -> html.HtmlTable:
    """Return a line for each case, with a link to its report; the page stands next to the folder of verdicts."""
    return html.table(CASE_HEADINGS, [_case(row) for row in rows], numbers=(4, 5, 6, 7))


def _case(row: Row) -> list[Any]:
    return [
        _unbroken(row["case"]),
        str(row["kind"]).replace(PAIR_SIGN, f"{PAIR_SIGN}\u200b"),  # a line may break there
        _found(row),
        _unbroken(_outcome(row)),
        *_errors(row),
        _number(quantiles(row["fresh_over_floor"], (0.5,))[0]),
        _report(VERDICTS, row) or row["fault"] or "",
    ]


def _wire_section(rows: Sequence[Row]) -> html.Section:
    right = sum(bool(row["success"]) for row in rows)
    sentence = (
        "The effect sits in simulated slaves served by a process of its own; the tool has CANopen and Modbus, runs its "
        "own tests, and the seal is opened once its verdict is written."
    )
    lines = [[row["case"], row["where"], _found(row), _outcome(row), *_errors(row), _report(WIRE, row)] for row in rows]
    table = html.table(RIG_HEADINGS, lines, numbers=(4, 5, 6))
    return html.section(f"Over the wire: {right} of {len(rows)}", html.paragraph(sentence), table)


def _found(row: Row) -> str:
    if "verdict" not in row:
        return str(row.get("said") or "nothing: the command failed")
    return ", ".join(row["named"]) or str(row["verdict"]).replace("_", " ")


def _outcome(row: Row) -> str:
    return f"{'✓' if row['success'] else '✗'} {row['outcome']}"


def _errors(row: Row) -> list[str]:
    fit: Mapping[str, Any] = row.get("fit", {})
    return [_number(fit.get(name)) for name in ("retuned", "augmented", "noise_floor")]


def _report(folder: str, row: Row) -> html.Link | str:
    return html.Link("report", f"{folder}/{row['case']}/report.html") if "verdict" in row else ""


def _real_section(cases: Sequence[Mapping[str, Any]]) -> html.Section:
    pieces: list[Any] = [
        html.paragraph(
            "Recordings of real machines. What is concealed was taken out of the files, or left out of the nominal "
            "model, before the tool read them; the truth withheld was read after its verdict."
        )
    ]
    for case in cases:
        pieces += [html.Heading(case["title"]), html.paragraph(f"Concealed: {case['conceals']}")]
        pieces.append(html.table(REAL_HEADINGS, [_real_run(run) for run in case["runs"]], numbers=(2, 3)))
        agreements = [each for run in case["runs"] for each in run["agreements"]]
        if agreements:
            pieces.append(html.table(AGREEMENTS, map(_agreement, agreements), (1, 2)))
    return html.section("Real recordings", *pieces)


def _real_run(run: Mapping[str, Any]) -> list[Any]:
    found = run["fault"] or ", ".join(run["named"]) or str(run["verdict"]).replace("_", " ")
    report = html.Link("report", f"{REAL}/{run['report']}") if run["report"] else ""
    errors = [_number(run["held_out"][stage]) for stage in ("before", "after")]
    return [run["name"], f"{'✓' if run['right'] else '✗'} {found}", *errors, report]


def _agreement(entry: Mapping[str, Any]) -> tuple[str, str, str, str, str]:
    found, known = (f"{_number(entry[key])} {entry['unit']}".strip() for key in ("found", "truth"))
    inside = {True: "holds it", False: "misses it", None: ""}[entry["inside"]]
    return entry["what"], found, known, inside, f"{'✓' if entry['within'] else '✗'} {entry['asked']}"


def _unbroken(text: str) -> str:
    return text.replace(" ", "\u00a0")


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}"


def _rate(rows: Sequence[Row], wanted: Sequence[str]) -> Rate:
    return share(row["outcome"] in wanted for row in rows)


def _percent(rate: Rate) -> str:
    return f"{100.0 * rate.value:.0f} %" if rate.trials else "–"


def _interval(rate: Rate) -> str:
    low, high = rate.interval
    return f"{100.0 * low:.0f} to {100.0 * high:.0f} %"
