"""Plots in text: a title, an axis on the left, dots."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.signals.record import FloatArray
from hil.monitor.braille import Canvas, envelope

AXIS = 8
"""Characters for the numbers on the left and the line next to them."""


@dataclass(frozen=True, slots=True)
class Range:
    """What an axis shows."""

    low: float
    high: float


def title(text: str, value: str, width: int) -> str:
    """Give a rule with what is shown on its left and its present value on its right, cut to the width."""
    room = max(0, width - len(value) - 4)
    left = text if len(text) <= room else text[: max(0, room - 1)] + "…"
    rule = "─" * max(0, width - len(left) - len(value) - 4)
    return f"─ {left} {rule} {value}"[:width].ljust(width)


def nice_range(values: FloatArray, least: float) -> Range:
    """Choose an axis that holds all values and changes seldom: bounds are multiples of 1, 2 or 5 powers of ten."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    missing = max(0.0, least - (high - low)) / 2.0
    low, high = low - missing, high + missing
    step = nice_step((high - low) / 8.0)
    return Range(math.floor(low / step + 1e-9) * step, math.ceil(high / step - 1e-9) * step)


def nice_step(least: float) -> float:
    """Give the smallest of 1, 2 and 5 times a power of ten that is not below."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= least * (1.0 - 1e-9))


def wrapped(head: str, text: str, width: int, height: int) -> list[str]:
    """Give a panel that holds words: its title, and the text in as many lines as it takes."""
    return [head, *textwrap.wrap(text, max(width, 1))][:height]


def number(value: float) -> str:
    """Write an axis's number in at most six characters."""
    if not math.isfinite(value):
        return "--"
    text = f"{value:.4g}"
    return text if len(text) <= 6 else f"{value:.1g}"


def strip(x: FloatArray, y: FloatArray, x_range: Range, y_range: Range, width: int, height: int) -> list[str]:
    """Plot one curve over an axis with its ends; ``height`` lines of ``width`` characters."""
    canvas = Canvas(width - AXIS, height)
    if canvas.width and canvas.height:
        _curve(canvas, x, y, x_range, y_range)
    return with_axis(canvas.lines(), y_range, height)


def _curve(canvas: Canvas, x: FloatArray, y: FloatArray, x_range: Range, y_range: Range) -> None:
    dots_x = (x - x_range.low) / (x_range.high - x_range.low) * (canvas.width - 1)
    dots_y = height_of(y, y_range, canvas.height)
    for column, low, high in envelope(dots_x, dots_y, canvas.width):
        canvas.bar(column, low, high)


def height_of(y: FloatArray, y_range: Range, dots: int) -> FloatArray:
    """Rows of dots of values, the lower bound at the bottom."""
    return np.asarray((1.0 - (y - y_range.low) / (y_range.high - y_range.low)) * (dots - 1), dtype=np.float64)


def with_axis(lines: Sequence[str], y_range: Range, height: int) -> list[str]:
    """Put the axis on the left of lines: its upper end, its lower end, and its middle where there is room."""
    labels = {0: y_range.high, height - 1: y_range.low}
    if height >= 5 and height % 2:
        labels[height // 2] = (y_range.high + y_range.low) / 2.0
    return [
        f"{number(labels[row]):>6} ┤{line}" if row in labels else f"{'':>6} │{line}" for row, line in enumerate(lines)
    ]


def time_axis(window_s: float, width: int) -> str:
    """Write the ends of an axis of the last seconds."""
    left, right = f"-{window_s:g} s", "now"
    line = " " * (AXIS - 1) + "└" + left + " " * max(1, width - AXIS - len(left) - len(right)) + right
    return line[:width]
