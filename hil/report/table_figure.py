"""The section of a page on a law without a name: the curve with its band, in words and as a formula."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from estimator.diagnosis.result import UnnamedTable
from estimator.diagnosis.table_curves import values_at
from estimator.diagnosis.tables import sentences
from estimator.physics.tables import Table
from hil.report import page as html
from hil.report.figures import LEGEND_PX, PANEL_PX, Style, figure_block
from hil.report.page import Figure

POINTS = 200


def section(table: UnnamedTable, error_unit: str) -> html.Section:
    """Return the section."""
    return html.section(
        "A law without a name",
        html.paragraph(f"{sentences(table, error_unit)} It describes, and is no cause."),
        _figure(table),
        html.note(
            "The line is the curve"
            + (", with what the line has there by itself, which is dotted" if table.slope else "")
            + "; the points are its values at the knots with their 95 % intervals; dashed, where no recording was."
        ),
    )


def _figure(table: UnnamedTable) -> Figure:
    knots = np.array(table.knots)
    values = np.array(table.values) + table.slope * knots
    ends = (min(knots[0], table.reached[0]), max(knots[-1], table.reached[1]))
    x = np.union1d(np.linspace(*ends, POINTS), list(table.reached))
    y = values_at(Table(table.place, table.knots, table.values), x) + table.slope * x
    seen = (x >= table.reached[0]) & (x <= table.reached[1])
    colour, width, _ = Style.AFTER.value
    figure = go.Figure()
    if table.slope:
        dotted = {"color": Style.BEFORE.value[0], "width": width, "dash": "dot"}
        figure.add_trace(go.Scatter(x=x, y=table.slope * x, mode="lines", line=dotted, name="the line alone"))
    dashed = {"color": colour, "width": width, "dash": "dash"}
    figure.add_trace(go.Scatter(x=x, y=y, mode="lines", line=dashed, name="beyond the recordings"))
    solid = {"color": colour, "width": 2.2}
    figure.add_trace(go.Scatter(x=x, y=np.where(seen, y, np.nan), mode="lines", line=solid, name="law found"))
    half = [0.5 * (high - low) for low, high in table.ci95]
    bars = {"type": "data", "array": half, "thickness": width, "width": 3}
    marker = {"color": Style.BEFORE.value[0], "size": 7, "symbol": "diamond"}
    figure.add_trace(go.Scatter(x=knots, y=values, mode="markers", marker=marker, name="at knots, 95 %", error_y=bars))
    figure.update_xaxes(title_text=f"{table.over} [{table.unit}]")
    figure.update_yaxes(title_text=f"torque [{table.torque_unit}]")
    return figure_block(figure, "law-without-a-name", PANEL_PX + 90 + LEGEND_PX)
