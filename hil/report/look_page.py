"""The page of ``hil look --plot``: the raw channels over time, and the stretch in view as the lines that cut it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.preconditions.channels import clipped
from estimator.signals.record import FloatArray
from hil.figures.palette import GREY, ORANGE, PURPLE
from hil.printable import printable
from hil.recording.formats import read_table
from hil.recording.look import Look
from hil.recording.request import Request
from hil.recording.scales import Role, scale_of
from hil.recording.signals import in_mask
from hil.recording.signals_config import MaskRange, SignalsConfig
from hil.recording.survey import Group
from hil.recording.table import Table
from hil.report import page as html
from hil.report.figures import Curve, Mark, Panel, Style, time_figure

MOST_DRAWN: Final = 24
"""Panels of a group: what could be a torque or an output comes first."""

GAP: Final = 1.5
"""Periods from one row to the next beyond which rows are missing."""

LEGEND: Final = "Shaded: orange, rows or values are missing; purple, a reading stands at its end; grey, masked."

MOST_MARKS: Final = 200
"""Of one kind in one channel: more can't be distinguished."""


def look_page(found: Look, signals: SignalsConfig, request: Request) -> str:
    """Return the text of the page; ``signals`` is what the recording is read by, with its masks."""
    drawn = [_group(found, group, i, signals, request) for i, group in enumerate(found.survey.groups)]
    count = sum(len(group.channels) for group in found.survey.groups)
    title = printable(f"{found.path.name}: {count} channels")
    lines = html.Preformatted("\n".join(found.signals)) if found.signals else None
    return html.page(
        title,
        [
            html.header(title, [html.paragraph(printable(line)) for line in found.survey.said], html.note(LEGEND)),
            *drawn,
            html.section("Read by", lines) if lines else None,
        ],
        "hil look. Values as they are in the file; zoom in by dragging, back by a double click.",
    )


def _group(found: Look, group: Group, number: int, signals: SignalsConfig, request: Request) -> html.Section | None:
    """Draw the channels of one time, each in a panel of its own."""
    guessed = [guess.channel.name for guess in found.roles.torques]
    guessed += [found.roles.output.channel.name] if found.roles.output else []
    numbers = [each.name for each in group.channels if each.moves and each.name != group.time]
    names = sorted(numbers, key=lambda name: (name not in guessed, numbers.index(name)))[:MOST_DRAWN]
    if group.rows < 2 or not names:
        return None
    table = read_table(found.path, replace(request, columns=tuple(names), time=group.time))
    time_s = _time_s(table, group, signals)
    values = table.numeric(names)
    units = {each.name: f" [{each.unit}]" for each in group.channels if each.unit and each.unit not in each.name}
    panels = [
        Panel(printable(f"{name}{units.get(name, '')}"), (Curve(printable(name), values[name], Style.FIRST_INPUT),))
        for name in names
    ]
    marks = [*_gaps(time_s), *_marks(time_s, values, signals.mask)]
    figure = f"channels-{number}"
    left = len(numbers) - len(names)
    return html.section(
        f"every {group.period_s:.4g} s" if group.period_s else "without a time: over the number of the row",
        html.note(f"{left} more channels are not drawn.") if left else None,
        time_figure(figure, time_s, panels, 1, marks),
        html.Cut(figure) if group.time is not None else None,
    )


def _time_s(table: Table, group: Group, signals: SignalsConfig) -> FloatArray:
    """Return the time as ``from_s`` and ``to_s`` of [signals] count it; without one the numbers of the rows."""
    if group.time is None:
        return np.arange(table.n_rows, dtype=np.float64)
    given = signals.time.given_scale if signals.time.column == group.time else None
    time: FloatArray = table.numeric([group.time])[group.time] * scale_of(table, group.time, Role.TIME, given)
    return time


def _gaps(time_s: FloatArray) -> Iterator[Mark]:
    steps = np.diff(time_s)
    for row in np.flatnonzero(steps > GAP * np.median(steps)).tolist():
        yield Mark(float(time_s[row]), float(time_s[row + 1]), ORANGE)


def _marks(time_s: FloatArray, values: dict[str, FloatArray], masks: list[MaskRange]) -> Iterator[Mark]:
    """Mark where a value is missing, stands at the end of its range, or is outside a mask's."""
    for name, each in values.items():
        yield from _spans(time_s, ~np.isfinite(each), ORANGE)
        for found in clipped(name, each, np.isfinite(each)):
            yield from _spans(time_s, found.rows, PURPLE)
        for mask in masks:
            if mask.column == name:
                yield from _spans(time_s, ~in_mask(each, mask), GREY)


def _spans(time_s: FloatArray, rows: NDArray[np.bool_], colour: str) -> Iterator[Mark]:
    edges = np.diff(np.concatenate([[0], rows.astype(np.int8), [0]]))
    spans = np.column_stack([np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)])[:MOST_MARKS]
    for first, end in spans.tolist():
        yield Mark(float(time_s[first]), float(time_s[min(end, time_s.size - 1)]), colour)
