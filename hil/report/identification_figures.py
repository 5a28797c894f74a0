"""Poles and zeros, correlations of what a model leaves, and the course of an on-line estimate, by plotly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from estimator.identification.chain import OnlineTrajectory
from estimator.identification.linear_model import ComplexArray
from estimator.identification.modes.modes import QUANTILE
from estimator.identification.offline.validation import CorrelationTest, Validation
from estimator.signals.record import FloatArray, IntArray
from hil.figures.local_model import LocalModel
from hil.figures.palette import (
    BLACK,
    BLUE,
    GREY,
    VERMILION,
    damping_lines,
    faded,
    frequency_marks,
    series_colour,
    unit_circle,
)
from hil.report.figures import band, compact, extremes, figure_block
from hil.report.page import Figure

MAP_PX = 640
GUIDE = "#c5ccd4"
MARGIN = 1.25
"""Half width of the first view; zeros far outside are left to zooming."""

PANEL_PX, AROUND_PX = 160, 140

COURSE_PX = 780
STRETCHES = 400
"""A course is drawn with two points in each of so many parts."""

VIEW_SHARE = {"hz": 0.1, "damping": 0.6}
"""First view about the last estimate, to either side, in parts of it: the start-up is far outside."""


@dataclass(frozen=True, slots=True)
class PoleSet:
    """Poles and zeros of one model."""

    name: str  # in the legend
    poles: ComplexArray  # in z
    zeros: ComplexArray  # in z
    colour: str  # as ``#rrggbb``
    regions: tuple[FloatArray, ...] = ()  # outlines of 95 % confidence regions, each of shape (K, 2)
    reference: bool = False  # true for one that was not identified but is known
    hidden: bool = False  # waits in the legend


def pole_figure(name: str, sets: Sequence[PoleSet], sample_time_s: float) -> Figure:
    """Draw poles as crosses and zeros as circles; those of one model share a colour and a legend entry."""
    figure = go.Figure()
    _guides(figure, sample_time_s)
    for each in sorted(sets, key=lambda each: not each.reference):
        _draw(figure, each)
    figure.update_xaxes(title_text="real part", range=[-MARGIN, MARGIN], zeroline=True, constrain="domain")
    figure.update_yaxes(title_text="imaginary part", range=[-MARGIN, MARGIN], scaleanchor="x", zeroline=True)
    figure.update_layout(hovermode="closest")
    return figure_block(figure, name, MAP_PX, hover="closest")


def _guides(figure: go.Figure, sample_time_s: float) -> None:
    look = {"mode": "lines", "hoverinfo": "skip", "showlegend": False}
    x, y = unit_circle()
    figure.add_trace(go.Scatter(x=x, y=y, line={"color": "#7c8590", "width": 1.2}, **look))
    for _, x, y in damping_lines():
        figure.add_trace(go.Scatter(x=x, y=y, line={"color": GUIDE, "width": 0.8, "dash": "dot"}, **look))
    marks = list(frequency_marks(sample_time_s))
    figure.add_trace(
        go.Scatter(
            x=[1.1 * z.real for _, z in marks],
            y=[1.1 * z.imag for _, z in marks],
            text=[f"{frequency_hz:g} Hz" for frequency_hz, _ in marks],
            mode="text",
            textfont={"size": 11, "color": "#5a6470"},
            hoverinfo="skip",
            showlegend=False,
        )
    )


def _draw(figure: go.Figure, each: PoleSet) -> None:
    group = {"legendgroup": each.name, "name": each.name, "visible": "legendonly" if each.hidden else True}
    for region in each.regions:
        figure.add_trace(
            go.Scatter(
                x=region[:, 0],
                y=region[:, 1],
                mode="lines",
                line={"color": each.colour, "width": 1},
                fill="toself",
                fillcolor=faded(each.colour, 0.15),
                hoverinfo="skip",
                showlegend=False,
                **group,
            )
        )
    size = 15 if each.reference else 9
    width = 2.4 if each.reference else 2.0
    for what, points, symbol in (("pole", each.poles, "x-thin-open"), ("zero", each.zeros, "circle-open")):
        figure.add_trace(
            go.Scatter(
                x=np.real(points),
                y=np.imag(points),
                mode="markers",
                marker={"symbol": symbol, "size": size, "color": each.colour, "line": {"width": width}},
                showlegend=what == "pole",
                hovertemplate=f"{each.name}, {what}<br>%{{x:.4f}} %{{y:+.4f}} i<extra></extra>",
                **group,
            )
        )


def known_sets(models: Sequence[LocalModel]) -> list[PoleSet]:
    """Return what is known of all experiments as one set in black; none where nothing is."""
    known = [(m.reference.name, m.reference.line, m.online.sample_time_s) for m in models if m.reference is not None]
    if not known:
        return []
    poles = np.concatenate([line.poles(period_s) for _, line, period_s in known])
    zeros = np.concatenate([line.zeros(period_s) for _, line, period_s in known])
    return [PoleSet(known[0][0], poles, zeros, BLACK, reference=True)]


def residual_figure(name: str, validation: Validation) -> Figure:
    """Draw residual against past input, against later input, and against itself, over one another."""
    panels = (
        ("with past input", validation.independence, VERMILION),
        ("with later input", validation.feedback, BLUE),
        ("with itself", validation.autocorrelation, GREY),
    )
    return _stacked(name, panels)


def correlation_figure(name: str, tests: Sequence[tuple[str, CorrelationTest]]) -> Figure:
    """Draw correlations by lag over one another, each under its title."""
    return _stacked(name, [(title, test, BLUE) for title, test in tests])


def _stacked(name: str, panels: Sequence[tuple[str, CorrelationTest, str]]) -> Figure:
    titles = [title for title, _, _ in panels]
    figure = make_subplots(
        rows=len(panels), cols=1, subplot_titles=titles, vertical_spacing=min(0.13, 0.3 / len(panels))
    )
    for row, (title, test, colour) in enumerate(panels, start=1):
        _stems(figure, row, title, test, colour)
    figure.update_xaxes(title_text="lag [samples]", row=len(panels), col=1)
    figure.update_annotations(font_size=13, x=0.0, xanchor="left")
    return figure_block(figure, name, AROUND_PX + PANEL_PX * len(panels), hover="closest")


def _stems(figure: go.Figure, row: int, title: str, test: CorrelationTest, colour: str) -> None:
    figure.add_trace(
        go.Bar(x=test.lag, y=test.correlation, name=title, marker={"color": colour}, width=0.35, showlegend=False),
        row=row,
        col=1,
    )
    figure.add_hrect(
        y0=-test.bound,
        y1=test.bound,
        fillcolor=faded(colour, 0.15),
        line_width=0,
        layer="below",
        row=row,
        col=1,
    )


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
    return figure_block(figure, name, COURSE_PX)


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
    figure.add_traces(band(x[given], (y - half)[given], (y + half)[given], BLUE), rows=row, cols=1)


def _line(x: FloatArray, y: FloatArray, name: str, look: Mapping[str, object], *, shown: bool = True) -> go.Scatter:
    xy = {"x": compact(x), "y": compact(y)}
    return go.Scatter(**xy, name=name, legendgroup=name, showlegend=shown, mode="lines", line=look)


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
