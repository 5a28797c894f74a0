"""A parameter's interval as a small drawing: tolerance, nominal value, value found and how well it is known."""

from __future__ import annotations

import math

WIDTH, HEIGHT, MARGIN = 200, 20, 6

LEAST_RANGE = 0.05
"""Of the nominal value: half the drawing's width at least."""


def interval_bar(nominal: float, value: float, low: float, high: float, tolerance: float) -> str:
    """Return an SVG drawing, all relative to the nominal value; empty where that is zero or the value is not known."""
    if nominal == 0.0 or not math.isfinite(value):
        return ""
    found = value / nominal - 1.0
    ends = [each / nominal - 1.0 if math.isfinite(each) else found for each in (low, high)]
    reach = 1.15 * max(tolerance, LEAST_RANGE, abs(found), *(abs(each) for each in ends))

    def x(share: float) -> float:
        return WIDTH / 2 + (WIDTH / 2 - MARGIN) * share / reach

    middle = HEIGHT / 2
    left, right = x(min(ends)), x(max(ends))
    label = f"{100 * found:+.1f} % of nominal, interval {100 * min(ends):+.1f} to {100 * max(ends):+.1f} %"
    return (
        f'<svg class="interval" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" role="img" '
        f'aria-label="{label}"><title>{label}</title>'
        f'<rect class="tolerance" x="{x(-tolerance):.1f}" y="3" width="{x(tolerance) - x(-tolerance):.1f}" '
        f'height="{HEIGHT - 6}"/>'
        f'<line class="nominal" x1="{x(0.0):.1f}" x2="{x(0.0):.1f}" y1="1" y2="{HEIGHT - 1}"/>'
        f'<rect class="ci" x="{left:.1f}" y="{middle - 2:.1f}" width="{max(right - left, 1.0):.1f}" height="4"/>'
        f'<circle class="value" cx="{x(found):.1f}" cy="{middle:.1f}" r="4"/></svg>'
    )
