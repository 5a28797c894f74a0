"""Plots in text: dots of braille, a title, an axis on the left, and the ring that holds what is plotted."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.signals.record import FloatArray

BLANK = 0x2800

_BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
"""Bit of each dot of a cell, by row and column (Unicode Standard, chapter 21.1)."""

AXIS = 8
"""Characters for the numbers on the left and the line next to them."""


class Canvas:
    """Dots, switched on by column and row from the upper left."""

    def __init__(self, columns: int, rows: int) -> None:
        self.width, self.height = 2 * max(columns, 0), 4 * max(rows, 0)
        self._dots = np.zeros((self.height, self.width), dtype=np.bool_)

    def dot(self, x: float, y: float) -> None:
        """Switch the dot nearest to a place on; outside the canvas nothing happens."""
        if not (np.isfinite(x) and np.isfinite(y)):
            return
        column, row = round(x), round(y)
        if 0 <= column < self.width and 0 <= row < self.height:
            self._dots[row, column] = True

    def bar(self, x: int, from_y: float, to_y: float) -> None:
        """Switch the dots of one column between two heights on, the part of it that is on the canvas."""
        low, high = sorted((round(from_y), round(to_y)))
        if 0 <= x < self.width and high >= 0 and low < self.height:
            self._dots[max(low, 0) : high + 1, x] = True

    def lines(self) -> list[str]:
        """Give the text, one string for each row of cells."""
        cells = self._dots.reshape(self.height // 4, 4, self.width // 2, 2).transpose(0, 2, 1, 3)
        codes = BLANK + (cells * _BITS).sum(axis=(2, 3))
        return ["".join(" " if code == BLANK else chr(code) for code in row) for row in codes.tolist()]


def envelope(x: FloatArray, y: FloatArray, width: int) -> list[tuple[int, float, float]]:
    """Gather a curve of many points into columns: lowest and highest of each, joined to the column before."""
    known = np.isfinite(y) & np.isfinite(x)
    columns = np.clip(np.floor(np.where(known, x, 0.0)).astype(np.int64), 0, max(width - 1, 0))[known]
    values = y[known]
    if not columns.size:
        return []
    starts = np.flatnonzero(np.r_[True, np.diff(columns) != 0])
    lows, highs = np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)
    lasts = values[np.r_[starts[1:] - 1, values.size - 1]]
    found: list[tuple[int, float, float]] = []
    for number, column in enumerate(columns[starts].tolist()):
        low, high = float(lows[number]), float(highs[number])
        if number and found[-1][0] == column - 1:
            before = float(lasts[number - 1])
            low, high = min(low, before), max(high, before)
        found.append((column, low, high))
    return found


@dataclass(frozen=True, slots=True)
class Range:
    """What an axis shows."""

    low: float  # at its left or lower end
    high: float  # at its right or upper end


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


class Ring:
    """Keeps the last ``length`` rows of ``columns`` numbers."""

    def __init__(self, length: int, columns: int) -> None:
        self._rows = np.empty((2 * length, columns))
        self._length = length
        self._end = 0

    def append(self, row: tuple[float, ...]) -> None:
        """Add a row of ``columns`` numbers; the oldest is left out where there are more than ``length``."""
        if self._end == self._rows.shape[0]:  # move the younger half to the front: once in ``length`` rows
            self._rows[: self._length] = self._rows[self._length :]
            self._end = self._length
        self._rows[self._end] = row
        self._end += 1

    def rows(self) -> FloatArray:
        """Copy what is kept, shape (n, columns), oldest first."""
        return self._rows[max(0, self._end - self._length) : self._end].copy()

    def clear(self) -> None:
        """Forget all rows."""
        self._end = 0
