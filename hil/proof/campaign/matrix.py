"""The confusion matrix as a picture: what was planted down, what was named across."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from html import escape

from hil.proof.campaign.kinds import kind
from hil.proof.campaign.score import right_columns
from hil.proof.campaign.statistics import Row, by_kind, columns, confusion, strongest_name

CELL_PX, LEFT_PX, TOP_PX, RIGHT_PX, BOTTOM_PX = 22, 190, 170, 90, 8
RIGHT, WRONG = (31, 119, 180), (214, 39, 40)
"""Colours of right answers and of all others, at full count."""


def confusion_of(rows: Sequence[Row]) -> str:
    """Draw the confusion matrix of scored cases.

    A column is right where it is what was planted or a look-alike of it, by the catalogue or as a case declared.
    """
    matrix, groups = confusion(rows), by_kind(rows)
    declared = {planted: {strongest_name(row) for row in groups[planted] if row["success"]} for planted in matrix}
    return confusion_svg(matrix, {planted: right_columns(kind(planted)) | declared[planted] for planted in matrix})


def confusion_svg(matrix: Mapping[str, Counter[str]], right: Mapping[str, Collection[str]]) -> str:
    """Draw a confusion matrix.

    Parameters
    ----------
    matrix
        Of `hil.proof.campaign.statistics.confusion`.
    right
        Columns that are right for each planted kind.

    Returns
    -------
    str
        An SVG document; each cell's colour is its share of the row, its number the count.
    """
    names = columns(matrix)
    width = LEFT_PX + CELL_PX * len(names) + RIGHT_PX
    height = TOP_PX + CELL_PX * len(matrix) + BOTTOM_PX
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
        'font-family="sans-serif" font-size="11">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
        f'<text x="{LEFT_PX - 8}" y="{TOP_PX - 8}" text-anchor="end" font-weight="bold">planted / named</text>',
        *(_heading(name, LEFT_PX + CELL_PX * (place + 0.5)) for place, name in enumerate(names)),
    ]
    for place, (planted, counts) in enumerate(matrix.items()):
        parts += _row(planted, counts, names, right[planted], TOP_PX + CELL_PX * place)
    return "\n".join([*parts, "</svg>", ""])


def _heading(name: str, x: float) -> str:
    y = TOP_PX - 6
    return f'<text x="{x:g}" y="{y}" transform="rotate(-60 {x:g} {y})">{escape(name)}</text>'


def _row(planted: str, counts: Counter[str], names: list[str], right: Collection[str], y: float) -> list[str]:
    middle = y + 0.5 * CELL_PX + 4
    parts = [f'<text x="{LEFT_PX - 8}" y="{middle:g}" text-anchor="end">{escape(planted)}</text>']
    for place, name in enumerate(names):
        x = LEFT_PX + CELL_PX * place
        count = counts[name]
        fill = _colour(RIGHT if name in right else WRONG, count / counts.total()) if count else "#fafafa"
        parts.append(f'<rect x="{x}" y="{y:g}" width="{CELL_PX}" height="{CELL_PX}" fill="{fill}" stroke="#dddddd"/>')
        if count:
            parts.append(f'<text x="{x + 0.5 * CELL_PX:g}" y="{middle:g}" text-anchor="middle">{count}</text>')
    return parts


def _colour(full: tuple[int, int, int], share: float) -> str:
    """Fade from white to at most 80 % of a colour, so that a number on it can be read."""
    red, green, blue = (round(255 - (255 - channel) * 0.8 * share) for channel in full)
    return f"#{red:02x}{green:02x}{blue:02x}"
