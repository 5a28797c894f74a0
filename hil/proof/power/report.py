"""What a power study adds up to: per effect the bounds' sizes, the tool's, and how many times the one is the other."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hil.proof.campaign.statistics import Rate, Row, finite, outcomes, share
from hil.proof.power.bound import HYPOTHESES, POWER, power
from hil.proof.power.fit import Curve, fit_curve
from hil.proof.power.sizes import SCALES

SCHEMA = "hil.power/1"

KNOWLEDGE = {
    "known": "everything known",
    "bus_unknown": "bus unknown",
    "recorded": "recordings alone",
}
"""What the best possible tests know, and what to call them."""

BASE = "recorded"
"""The one whose sizes are multiplied."""


def summary(rows: Sequence[Row], bounds: Sequence[Row]) -> dict[str, Any]:
    """Return what rows and bounds of a study add up to; JSON types only, null where a figure is not finite."""
    done = [row for row in rows if row["fault"] is None]
    return {
        "schema": SCHEMA,
        "power": POWER,
        "trials": len(done),
        "effects": {
            effect: _figures(mine, [row for row in bounds if row["kind"] == effect])
            for effect in SCALES
            if (mine := [row for row in done if row["effect"] == effect])
        },
        "faults": [
            {"kind": row["kind"], "seed": row["seed"], "fault": row["fault"]}
            for row in rows
            if row["fault"] is not None
        ],
    }


def _figures(rows: Sequence[Row], bounds: Sequence[Row]) -> dict[str, Any]:
    found = [row["found"] for row in rows]
    curves = {name: fit_curve([row["over"][name] for row in rows], found) for name in KNOWLEDGE}
    sizes = {name: [row["bound"][name] for row in bounds] for name in KNOWLEDGE}
    middle = float(np.median(sizes[BASE]))
    return {
        "unit": bounds[0]["unit"],
        "buses": len(bounds),
        "trials": len(rows),
        "alpha": bounds[0]["alpha"],
        "bound": {
            name: {"median": float(np.median(of)), "least": min(of), "most": max(of)} for name, of in sizes.items()
        },
        "size": _ends(curves[BASE], middle),
        "over": {name: _ends(curve) for name, curve in curves.items()},
        "steepness": curves[BASE].steepness,
        "points": [_point(rows, multiple) for multiple in sorted({row["multiple"] for row in rows})],
        "outcomes": outcomes(rows),
    }


def _ends(curve: Curve, unit: float = 1.0) -> dict[str, float | None]:
    """Return a curve's size and interval as JSON can have them; not rounded, for a size may be small."""
    ends = {"value": curve.size, "low": curve.low, "high": curve.high}
    return {name: value * unit if math.isfinite(value) else None for name, value in ends.items()}


def _point(rows: Sequence[Row], multiple: float) -> dict[str, Any]:
    """Return what was found at one multiple, and what the best tests would find at the same sizes."""
    mine = [row for row in rows if row["multiple"] == multiple]
    best = {
        name: finite(float(np.mean([power(row["distance"][name], row["alpha"]) for row in mine]))) for name in KNOWLEDGE
    }
    return {"multiple": multiple, **share(row["found"] for row in mine).as_json(), "best": best}


def markdown(rows: Sequence[Row], bounds: Sequence[Row]) -> str:
    """Return the summary as Markdown tables."""
    data = summary(rows, bounds)
    effects: Mapping[str, Any] = data["effects"]
    names = list(KNOWLEDGE.values())
    text = " | ".join(names)
    return "\n".join(
        [
            "# Power",
            "",
            f"{data['trials']} trials. Sizes that are found with {POWER:.0%} power; in brackets the range over the "
            "buses, or the 95 % interval. Best possible tests (module `hil.proof.power.bound`) by what they know; "
            f"alpha is their level, a {HYPOTHESES}th of 5 % unless it was set.",
            "",
            f"| effect | unit | alpha | {text} | tool | {' | '.join(f'tool / {name}' for name in names)} | trials |",
            f"|{' --- |' * (5 + 2 * len(names))}",
            *(_line(effect, figures) for effect, figures in effects.items()),
            "",
            "## By size",
            "",
            f"| effect | size / {KNOWLEDGE[BASE]} | found | interval | {' | '.join(f'best, {n}' for n in names)} |",
            f"|{' --- |' * (4 + len(names))}",
            *(_point_line(effect, point) for effect, figures in effects.items() for point in figures["points"]),
            "",
            "## Outcomes",
            "",
            *(f"- `{effect}`: {_counts(figures['outcomes'])}" for effect, figures in effects.items()),
            *_faults(data["faults"]),
            "",
        ]
    )


def _line(effect: str, figures: Mapping[str, Any]) -> str:
    bounds = (f"{of['median']:.3g} ({of['least']:.3g} to {of['most']:.3g})" for of in figures["bound"].values())
    cells = (
        f"`{effect}`",
        figures["unit"],
        f"{figures['alpha']:.2g}",
        *bounds,
        _interval(figures["size"]),
        *(_interval(of) for of in figures["over"].values()),
        f"{figures['trials']} on {figures['buses']} buses",
    )
    return f"| {' | '.join(cells)} |"


def _interval(of: Mapping[str, float | None]) -> str:
    value, low, high = of["value"], of["low"], of["high"]
    text = "not reached" if value is None else f"{value:.3g}" if value else "below all tried"
    ends = f"from {low or 0.0:.3g}" if high is None else f"{low or 0.0:.3g} to {high:.3g}"
    return f"{text} ({ends})"


def _point_line(effect: str, point: Mapping[str, Any]) -> str:
    low, high = Rate(point["hits"], point["trials"]).interval
    best = " | ".join(f"{share:.0%}" for share in point["best"].values())
    hits = f"{point['hits']} of {point['trials']}"
    return f"| `{effect}` | {point['multiple']:g} | {hits} | {low:.0%} to {high:.0%} | {best} |"


def _counts(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{name} {count}" for name, count in counts.items())


def _faults(faults: Sequence[Mapping[str, Any]]) -> list[str]:
    lines = [f"- `{fault['kind']}` seed {fault['seed']}: {fault['fault']}" for fault in faults]
    return ["", "## Commands that failed", "", *lines] if lines else []
