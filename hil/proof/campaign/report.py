"""The summary of a campaign: JSON for scripts, Markdown for people."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from hil.proof.campaign.kinds import Group
from hil.proof.campaign.statistics import (
    Rate,
    Row,
    banded,
    by_kind,
    columns,
    confusion,
    coverage,
    finite,
    outcomes,
    quantiles,
    share,
)

SCHEMA = "hil.campaign/1"

TITLES = {
    Group.SINGLE: "one effect of the catalogue",
    Group.PAIR: "two effects",
    Group.NONE: "nothing hidden, nominal values right",
    Group.OFF: "nothing hidden, nominal values off",
    Group.OUTSIDE: "an effect no entry describes",
}
WANTED = {
    Group.SINGLE: "it is named, and nothing else",
    Group.PAIR: "both are named, and nothing else",
    Group.NONE: "no mismatch",
    Group.OFF: "no mismatch",
    Group.OUTSIDE: "a mismatch, and no name",
}

FRESH_NOTE = (
    "*fresh / noise*: free-run RMS of the augmented model on fresh recordings over the noise of the speed reading, "
    "median. When an event takes place in a fresh recording is unknown to a simulation, and a fault of the acquisition "
    "is in the reading itself: there it can't reach 1."
)

BAND_NOTE = (
    "*band*: of the frequency bands reported, those right: at least half of the true mismatch's power is inside, and "
    "both bands share at least half of the wider."
)


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Return what the rows of a campaign add up to; JSON types only."""
    groups = {group: [row for row in rows if row["group"] == group.value] for group in Group}
    return {
        "schema": SCHEMA,
        "cases": len(rows),
        "band": _band_figures(rows),
        "groups": {group.value: _figures(members) for group, members in groups.items() if members},
        "kinds": {name: _figures(members) for name, members in by_kind(rows).items()},
        "confusion": {planted: dict(counts) for planted, counts in confusion(rows).items()},
        "coverage": {what: rate.as_json() for what, rate in coverage(rows).items()},
        "diagnose_s": dict(zip(("median", "p90", "max"), quantiles(row["diagnose_s"] for row in rows), strict=True)),
        "faults": [{"kind": row["kind"], "seed": row["seed"], "fault": row["fault"]} for row in rows if row["fault"]],
    }


def _figures(rows: Sequence[Row]) -> dict[str, Any]:
    located = [row["element_right"] for row in rows if row.get("element_right") is not None]
    ious = [iou for row in rows for iou in row.get("event_iou", {}).values()]
    return {
        "success": share(row["success"] for row in rows).as_json(),
        "outcomes": outcomes(rows),
        "element": share(located).as_json(),
        "event_iou_median": quantiles(ious, (0.5,))[0],
        "band": _band_figures(rows),
        "fresh_over_floor": dict(
            zip(("median", "p90"), quantiles((v for r in rows for v in r["fresh_over_floor"]), (0.5, 0.9)), strict=True)
        ),
        "diagnose_s_median": quantiles((row["diagnose_s"] for row in rows), (0.5,))[0],
    }


def _band_figures(rows: Sequence[Row]) -> dict[str, Any]:
    scores = banded(rows)
    return {
        "right": share(score["right"] for score in scores).as_json(),
        "power_share_median": quantiles((score["power_share"] for score in scores), (0.5,))[0],
        "width_ratio_median": quantiles((score["width_ratio"] for score in scores), (0.5,))[0],
    }


def markdown(rows: Sequence[Row]) -> str:
    """Return the summary as Markdown tables."""
    data = summary(rows)
    time_s = data["diagnose_s"]
    return "\n".join(
        [
            "# Campaign",
            "",
            f"{data['cases']} cases. Intervals of rates are Wilson's, 95 %. Time of `hil diagnose` per case: median "
            f"{_number(time_s['median'])} s, nine tenths within {_number(time_s['p90'])} s, at most "
            f"{_number(time_s['max'])} s.",
            "",
            "## By group",
            "",
            *_table(
                ("hidden", "wanted", "cases", "got it", "interval", "outcomes"),
                (
                    (TITLES[Group(name)], WANTED[Group(name)], *_rate_cells(figures), _counts(figures["outcomes"]))
                    for name, figures in data["groups"].items()
                ),
            ),
            "",
            "## By kind",
            "",
            *_table(
                (
                    "planted",
                    "cases",
                    "got it",
                    "interval",
                    "element",
                    "event IoU",
                    "band",
                    "fresh / noise",
                    "time s",
                    "outcomes",
                ),
                (
                    (
                        f"`{name}`",
                        *_rate_cells(figures),
                        _percent(figures["element"]["rate"]),
                        _number(figures["event_iou_median"]),
                        _percent(figures["band"]["right"]["rate"]),
                        _number(figures["fresh_over_floor"]["median"]),
                        _number(figures["diagnose_s_median"]),
                        _counts(figures["outcomes"]),
                    )
                    for name, figures in data["kinds"].items()
                ),
            ),
            "",
            FRESH_NOTE,
            "",
            BAND_NOTE,
            "",
            "## What was named",
            "",
            *_confusion_table(rows),
            "",
            "## Intervals that held the truth",
            "",
            *_table(("parameter", "cases", "held", "interval"), _coverage_rows(rows)),
            "",
            *_faults(data["faults"]),
        ]
    )


def _rate_cells(figures: Mapping[str, Any]) -> tuple[str, str, str]:
    success = figures["success"]
    low, high = success["ci95"]
    return str(success["trials"]), _percent(success["rate"]), f"{_percent(low)} to {_percent(high)}"


def _coverage_rows(rows: Sequence[Row]) -> Iterable[tuple[str, ...]]:
    rates = coverage(rows)
    everything = Rate(sum(rate.hits for rate in rates.values()), sum(rate.trials for rate in rates.values()))
    for what, rate in {**rates, "all": everything}.items():
        low, high = rate.interval
        yield what, str(rate.trials), _percent(finite(rate.value)), f"{_percent(low)} to {_percent(high)}"


def _confusion_table(rows: Sequence[Row]) -> list[str]:
    matrix = confusion(rows)
    names = columns(matrix)
    return _table(
        ("planted", "named"),
        (
            (f"`{planted}`", ", ".join(f"`{name}` {counts[name]}" for name in names if counts[name]))
            for planted, counts in matrix.items()
        ),
    )


def _faults(faults: Sequence[Mapping[str, Any]]) -> list[str]:
    if not faults:
        return []
    lines = [f"- `{fault['kind']}` seed {fault['seed']}: {fault['fault']}" for fault in faults]
    return ["## Commands that failed", "", *lines, ""]


def _table(heading: Sequence[str], body: Iterable[Sequence[str]]) -> list[str]:
    rows = [heading, ["---"] * len(heading), *body]
    return [f"| {' | '.join(cell.replace('|', '/') for cell in row)} |" for row in rows]


def _counts(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{name} {count}" for name, count in counts.items())


def _percent(value: float | None) -> str:
    return "" if value is None or math.isnan(value) else f"{100.0 * value:.0f} %"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"
