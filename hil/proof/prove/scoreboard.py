"""The scoreboard: what was concealed, what was found, how much better the fit became; every miss. HTML and JSON."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil.proof.campaign.kinds import Group
from hil.proof.campaign.matrix import confusion_of
from hil.proof.campaign.report import TITLES, WANTED, summary
from hil.proof.campaign.statistics import Rate, Row, banded, coverage, quantiles, share
from hil.proof.prove.scoreboard_cases import cases_table
from hil.proof.prove.scoreboard_real import real_section
from hil.proof.prove.scoreboard_wire import wire_section
from hil.provenance import Provenance
from hil.report import page as html
from hil.report.made import made_section

SCHEMA = "hil.scoreboard/1"
PAGE, DATA = "scoreboard.html", "scoreboard.json"
WIRE, REAL = "wire", "real"
"""Folders next to the page."""

FALSE_CLAIMS = ("false_claim", "wrong", "invented")
"""Outcomes in which something was named that is not there."""

FOOTER = (
    "hil prove. What was hidden was drawn by a simulator that shares no code with the model that is fitted, and sealed "
    "before the public command saw the recordings. Intervals of rates are Wilson's, 95 %."
)


@dataclass(frozen=True, slots=True)
class Board:
    """Everything the scoreboard shows.

    Attributes
    ----------
    sealed
        Rows of `hil.proof.prove.judge_set.judge_set`.
    wire
        Rows of `hil.proof.wire.run.run_wire`.
    real
        Cases of ``real.json`` (`hil.proof.real.result`).
    made
        Model files and recordings of the sealed cases.
    """

    sealed: Sequence[Row]
    wire: Sequence[Row] = ()
    real: Sequence[Mapping[str, Any]] = ()
    made: Provenance | None = None


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
        "summary": summary(rows),
        "false_claims": _rate(rows, FALSE_CLAIMS).as_json(),
        "cases": [dict(row) for row in rows],
        "wire": [dict(row) for row in board.wire],
        "real": [dict(case) for case in board.real],
        "made": None if board.made is None else board.made.document(),
    }


def scoreboard_page(board: Board) -> str:
    """Return the page: figures first, misses next, then rigs, real recordings and every sealed case."""
    rows = board.sealed
    misses = [row for row in rows if not row["success"]]
    title = f"{len(rows) - len(misses)} of {len(rows)} sealed cases answered as they should be"
    sections = [
        html.header(title, html.tiles(_tiles(rows))),
        html.section("By what was hidden", _groups(rows)),
        html.section("Misses", cases_table(misses) if misses else html.paragraph("None.")),
        *([wire_section(board.wire, WIRE)] if board.wire else []),
        *([real_section(board.real, REAL)] if board.real else []),
        html.section("What was named", html.Picture(confusion_of(rows), "what was hidden against what was named")),
        html.section("Every case", cases_table(rows)),
        made_section(board.made),
    ]
    return html.page("Scoreboard", sections, FOOTER)


def _tiles(rows: Sequence[Row]) -> list[tuple[str, str, str]]:
    sizes = coverage(rows).values()
    held = Rate(sum(rate.hits for rate in sizes), sum(rate.trials for rate in sizes))
    fresh = quantiles((value for row in rows for value in row["fresh_over_floor"]), (0.5,))[0]
    located = share(row["element_right"] for row in rows if row.get("element_right") is not None)
    banded_right = share(band["right"] for band in banded(rows))
    return [
        (
            "as it should be",
            _percent(share(row["success"] for row in rows)),
            _interval(share(r["success"] for r in rows)),
        ),
        (
            "something named that is not there",
            _percent(_rate(rows, FALSE_CLAIMS)),
            _interval(_rate(rows, FALSE_CLAIMS)),
        ),
        ("right element", _percent(located), _interval(located)),
        ("right frequency band", _percent(banded_right), _interval(banded_right)),
        ("95 % intervals that hold the truth", _percent(held), f"of {held.trials}"),
        ("error on fresh recordings", "–" if fresh is None else f"{fresh:.3g} ×", "the sensor's noise, median"),
    ]


def _groups(rows: Sequence[Row]) -> html.Table:
    lines = []
    for group in Group:
        members = [row for row in rows if row["group"] == group.value]
        if members:
            rate = share(row["success"] for row in members)
            lines.append(
                (TITLES[group], WANTED[group], f"{rate.hits} of {rate.trials}", _percent(rate), _interval(rate))
            )
    return html.table(("hidden", "wanted", "cases", "rate", "interval"), lines, numbers=(2, 3))


def _rate(rows: Sequence[Row], outcomes: Sequence[str]) -> Rate:
    return share(row["outcome"] in outcomes for row in rows)


def _percent(rate: Rate) -> str:
    return f"{100.0 * rate.value:.0f} %" if rate.trials else "–"


def _interval(rate: Rate) -> str:
    low, high = rate.interval
    return f"{100.0 * low:.0f} to {100.0 * high:.0f} %"
