"""A canvas of dots in text: each character cell holds 2 by 4 of them (Unicode braille patterns, U+2800 to U+28FF)."""

from __future__ import annotations

import numpy as np

from estimator.signals.record import FloatArray

BLANK = 0x2800

_BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
"""Bit of each dot of a cell, by row and column (Unicode Standard, chapter 21.1)."""


class Canvas:
    """Dots, switched on by column and row from the upper left.

    Parameters
    ----------
    columns, rows
        Character cells.
    """

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

    def line(self, x0: float, y0: float, x1: float, y1: float) -> None:
        """Switch the dots on the way from one place to another on."""
        steps = max(1, round(max(abs(x1 - x0), abs(y1 - y0))))
        for share in np.linspace(0.0, 1.0, steps + 1).tolist():
            self.dot(x0 + share * (x1 - x0), y0 + share * (y1 - y0))

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
