"""Power against size as a picture: what the tool found, its fitted curve, and the best possible tests."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from hil.proof.campaign.statistics import Rate
from hil.proof.power.bound import POWER
from hil.proof.power.fit import Curve
from hil.proof.power.report import BASE, KNOWLEDGE

WIDTH_PX, HEIGHT_PX, LEFT_PX, TOP_PX, GAP_PX, BOTTOM_PX = 250, 170, 52, 46, 40, 40
PER_ROW = 3
"""Panels next to each other: a page shows them at the size of its text."""

TOOL = "#1f77b4"

BEST = {"recorded": "#2ca02c", "bus_unknown": "#98df8a", "known": "#7f7f7f"}
"""Colours of the best possible tests."""

FINEST = 120
"""Points of a curve."""

LEAST_SHARE = 0.5
"""Where the axis begins, over the least size tried."""


def power_svg(effects: Mapping[str, Any]) -> str:
    """Draw a panel for each effect.

    Parameters
    ----------
    effects
        ``effects`` of `hil.proof.power.report.summary`.

    Returns
    -------
    str
        An SVG document; across is the size over that of the best test that has the recordings alone, logarithmic.
    """
    rows = math.ceil(len(effects) / PER_ROW)
    row_px = HEIGHT_PX + BOTTOM_PX + GAP_PX
    width = LEFT_PX + (WIDTH_PX + GAP_PX) * PER_ROW
    height = TOP_PX + rows * row_px - GAP_PX
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
        'font-family="sans-serif" font-size="11">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
        *_legend(),
    ]
    for place, (effect, figures) in enumerate(effects.items()):
        row, column = divmod(place, PER_ROW)
        panel = _panel(effect, figures, LEFT_PX + column * (WIDTH_PX + GAP_PX))
        parts += [f'<g transform="translate(0 {row * row_px})">', *panel, "</g>"]
    return "\n".join([*parts, "</svg>", ""])


def _legend() -> list[str]:
    parts = []
    lines = [(TOOL, "tool"), *((colour, f"best test, {KNOWLEDGE[name]}") for name, colour in BEST.items())]
    for place, (colour, name) in enumerate(lines):
        x = LEFT_PX + 190 * place
        parts.append(f'<line x1="{x}" y1="12" x2="{x + 18}" y2="12" stroke="{colour}" stroke-width="2"/>')
        parts.append(f'<text x="{x + 24}" y="16">{name}</text>')
    return parts


def _panel(effect: str, figures: Mapping[str, Any], left: float) -> list[str]:
    points: Sequence[Mapping[str, Any]] = figures["points"]
    least, most = LEAST_SHARE * points[0]["multiple"], points[-1]["multiple"]

    def across(size: float) -> float:
        return left + WIDTH_PX * math.log(size / least) / math.log(most / least)

    def line(colour: str, heights: Sequence[tuple[float, float]]) -> str:
        path = " ".join(f"{across(size):.1f},{_up(height):.1f}" for size, height in heights)
        return f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="1.5"/>'

    sizes = np.geomspace(least, most, FINEST)
    parts = [
        *_frame(effect, points, left, across),
        *(line(colour, [(p["multiple"], p["best"][name]) for p in points]) for name, colour in BEST.items()),
    ]
    if figures["over"][BASE]["value"]:
        curve = Curve(figures["over"][BASE]["value"], 0.0, math.inf, figures["steepness"])
        parts.append(line(TOOL, [(float(size), curve.power(float(size))) for size in sizes]))
    for point in points:
        x = across(point["multiple"])
        low, high = Rate(point["hits"], point["trials"]).interval
        parts.append(f'<line x1="{x:.1f}" y1="{_up(low):.1f}" x2="{x:.1f}" y2="{_up(high):.1f}" stroke="{TOOL}"/>')
        parts.append(f'<circle cx="{x:.1f}" cy="{_up(point["rate"]):.1f}" r="3" fill="{TOOL}"/>')
    return parts


def _frame(
    effect: str, points: Sequence[Mapping[str, Any]], left: float, across: Callable[[float], float]
) -> list[str]:
    bottom = TOP_PX + HEIGHT_PX
    parts = [
        f'<rect x="{left}" y="{TOP_PX}" width="{WIDTH_PX}" height="{HEIGHT_PX}" fill="none" stroke="#aaaaaa"/>',
        f'<text x="{left}" y="{TOP_PX - 6}" font-weight="bold">{escape(effect)}</text>',
        f'<text x="{left + 0.5 * WIDTH_PX}" y="{bottom + 30}" text-anchor="middle">size / bound</text>',
        *(f'<text x="{left - 6}" y="{_up(at) + 4:.1f}" text-anchor="end">{at:g}</text>' for at in (0.0, 0.5, POWER)),
        f'<line x1="{left}" y1="{_up(POWER):.1f}" x2="{left + WIDTH_PX}" y2="{_up(POWER):.1f}" stroke="#dddddd"/>',
    ]
    for point in points:
        x = across(point["multiple"])
        parts.append(f'<text x="{x:.1f}" y="{bottom + 14}" text-anchor="middle">{point["multiple"]:g}</text>')
    return parts


def _up(height: float) -> float:
    return TOP_PX + HEIGHT_PX * (1.0 - height)
