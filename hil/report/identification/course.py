"""How an on-line estimate came about: resonance and damping with their bands, and every parameter, over time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from estimator.identification.modes.propagate import QUANTILE
from estimator.identification.online_estimate import OnlineTrajectory
from estimator.signals.record import FloatArray, IntArray
from hil.figures.local_model import LocalModel
from hil.figures.palette import BLACK, BLUE, VERMILION, faded, series_colour
from hil.report.figures import extremes, figure_block
from hil.report.page import Figure

HEIGHT_PX = 780
STRETCHES = 400
"""A course is drawn with two points in each of so many parts."""

VIEW_SHARE = {"hz": 0.1, "damping": 0.6}
"""First view about the last estimate, to either side, in parts of it: the start-up is far outside."""


def course_figure(name: str, course: OnlineTrajectory, model: LocalModel) -> Figure:
    """Draw frequency, damping and theta over time; the off-line model and the reference are horizontal lines."""
    figure = make_subplots(rows=3, cols=1, shared_xaxes=True, vertical_spacing=0.04, row_heights=[0.33, 0.33, 0.34])
    _followed(figure, 1, course.time_s, course.frequency_hz, course.frequency_std_hz, "frequency [Hz]", first=True)
    _followed(figure, 2, course.time_s, course.damping, course.damping_std, "damping", first=False)
    _levels(figure, model)
    _view(figure, 1, course.frequency_hz, VIEW_SHARE["hz"])
    _view(figure, 2, course.damping, VIEW_SHARE["damping"])
    for number, parameter in enumerate(course.orders.names):
        y = course.estimates.theta[:, number]
        kept = extremes(y, STRETCHES)
        look = {"color": series_colour(number), "dash": "solid" if parameter.startswith("a") else "dot"}
        figure.add_trace(_line(course.time_s[kept], y[kept], parameter, look), row=3, col=1)
    figure.update_yaxes(title_text="theta", row=3, col=1)
    figure.update_xaxes(title_text="time [s]", row=3, col=1)
    return figure_block(figure, name, HEIGHT_PX)


def _followed(
    figure: go.Figure, row: int, time_s: FloatArray, y: FloatArray, std: FloatArray, axis: str, *, first: bool
) -> None:
    kept = extremes(y, STRETCHES)
    _band(figure, row, time_s[kept], y[kept], QUANTILE * std[kept])
    trace = _line(time_s[kept], y[kept], "on line, 95 % band", {"color": BLUE, "width": 1.8}, shown=first)
    figure.add_trace(trace, row=row, col=1)
    figure.update_yaxes(title_text=axis, row=row, col=1)


def _band(figure: go.Figure, row: int, x: FloatArray, y: FloatArray, half: FloatArray) -> None:
    """Shade where a standard deviation is given; from the first such moment on."""
    given: IntArray = np.flatnonzero(np.isfinite(half) & np.isfinite(y))
    edge = {"mode": "lines", "line": {"width": 0}, "showlegend": False, "hoverinfo": "skip"}
    low, high = (y - half)[given].astype(np.float32), (y + half)[given].astype(np.float32)
    figure.add_trace(go.Scatter(x=x[given], y=low, **edge), row=row, col=1)
    area = {"fill": "tonexty", "fillcolor": faded(BLUE, 0.2)}
    figure.add_trace(go.Scatter(x=x[given], y=high, **edge, **area), row=row, col=1)


def _line(x: FloatArray, y: FloatArray, name: str, look: Mapping[str, object], *, shown: bool = True) -> go.Scatter:
    x, y = x.astype(np.float32), y.astype(np.float32)
    return go.Scatter(x=x, y=y, name=name, legendgroup=name, showlegend=shown, mode="lines", line=look)


def _levels(figure: go.Figure, model: LocalModel) -> None:
    known = [("off-line model", model.found.batch_resonance, {"color": VERMILION, "dash": "dash", "width": 1.4})]
    if model.reference is not None:
        known.append((model.reference.name, model.reference_mode, {"color": BLACK, "dash": "dot", "width": 1.4}))
    ends = model.record.time_s[[0, -1]]
    for name, mode, look in known:
        if mode is None:
            continue
        for row, level in ((1, mode.frequency_hz), (2, mode.damping)):
            figure.add_trace(_line(ends, np.full(2, level), name, look, shown=row == 1), row=row, col=1)


def _view(figure: go.Figure, row: int, y: FloatArray, share: float) -> None:
    known = y[np.isfinite(y)]
    if known.size:
        last = float(known[-1])
        half = share * abs(last)
        figure.update_yaxes(range=[last - half, last + half], row=row, col=1)
