"""Figures of a mismatch: the law over its data, the input that would explain the error, its spectrum, the response."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from estimator.diagnosis.result import Course, Equivalent, ErrorSpectrum, Interval, LawPicture, Response
from estimator.signals.record import FloatArray
from hil.figures.palette import GREY
from hil.report import bode
from hil.report.figures import DECADES, LEGEND_PX, PANEL_PX, SHADE, Style, band, compact, extremes, figure_block
from hil.report.page import Figure
from hil.report.wording import PLACES

CHOICE_PX = 46
"""Room above a figure for the choice of a recording."""

GAP = 8.0
"""In distances of neighbouring bins: from here on nothing is drawn between two of them."""

FLOOR = {"color": "#777777", "width": 1.2, "dash": "dot"}


def law_figure(name: str, picture: LawPicture) -> Figure:
    """Draw a law over its signal with the data it was found from."""
    colour, width, _ = Style.AFTER.value
    order = np.argsort(picture.x)
    x, data = picture.x[order], picture.data[order]
    figure = go.Figure()
    line = {"color": colour, "width": 2.2}
    curve_x, curve = _broken(x, picture.law[order])
    figure.add_trace(go.Scatter(x=curve_x, y=curve, mode="lines", line=line, name="law found"))
    figure.add_trace(
        go.Scatter(
            x=x,
            y=data,
            mode="markers",
            marker={"color": Style.BEFORE.value[0], "size": 7, "symbol": "diamond"},
            error_y={
                "type": "data",
                "symmetric": False,
                "array": picture.high[order] - data,
                "arrayminus": data - picture.low[order],
                "thickness": width,
                "width": 3,
            },
            name="what the recordings ask for, 95 %",
        )
    )
    figure.add_hline(y=0.0, line={"color": "#b4bac1", "width": 1})
    figure.update_xaxes(title_text=f"{picture.signal} [{picture.signal_unit}]")
    figure.update_yaxes(title_text=f"{_what(picture)} [{picture.unit}]")
    return figure_block(figure, name, PANEL_PX + 90 + LEGEND_PX)


def _broken(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Break a line where the signal was not for long: what is not seen is not drawn."""
    gaps = np.flatnonzero(np.diff(x) > GAP * np.median(np.diff(x))) + 1
    return np.insert(x, gaps, np.nan), np.insert(y, gaps, np.nan)


def _what(picture: LawPicture) -> str:
    if picture.element.value in ("speed_sensor", "acquisition"):
        return "error of reading"
    return "force" if picture.unit == "N" else "torque"


def course_figure(
    name: str,
    equivalents: Sequence[Equivalent],
    recordings: Sequence[str],
    marked: Mapping[str, Sequence[Interval]],
    stretches: int,
) -> Figure:
    """Draw the input at every place over time, a panel each, one recording at a time."""
    count = len(equivalents)
    figure = make_subplots(rows=count, cols=1, shared_xaxes=True, vertical_spacing=0.05)
    shown: list[str] = []
    for recording in recordings:
        for row, equivalent in enumerate(equivalents, start=1):
            for trace in _course(equivalent.courses[recording], stretches, first=row == 1):
                trace.visible = recording == recordings[0]
                figure.add_trace(trace, row=row, col=1)
                shown.append(recording)
    for row, equivalent in enumerate(equivalents, start=1):
        figure.update_yaxes(title_text=f"{PLACES[equivalent.place]} [{equivalent.unit}]", row=row, col=1)
    figure.update_xaxes(title_text="time [s]", row=count, col=1)
    shapes = {recording: [_shade(low, high) for low, high in marked.get(recording, ())] for recording in recordings}
    _choose(figure, recordings, shown, shapes)
    figure.update_layout(shapes=shapes[recordings[0]])
    return figure_block(figure, name, 170 * count + LEGEND_PX + CHOICE_PX, top_px=34 + CHOICE_PX)


def _shade(low: float, high: float) -> dict[str, object]:
    place = {"type": "rect", "xref": "x", "yref": "paper", "x0": low, "x1": high, "y0": 0, "y1": 1}
    return {**place, "fillcolor": SHADE, "opacity": 0.18, "line": {"width": 0}, "layer": "below"}


def _course(course: Course, stretches: int, *, first: bool) -> list[go.Scatter]:
    colour, width, _ = Style.AFTER.value
    kept = extremes(course.value, stretches)
    x = course.time_s[kept]
    line = {"color": colour, "width": width}
    name = "would explain the error by itself"
    return [
        *band(x, course.low[kept], course.high[kept], colour, shown=first, name="95 % band"),
        go.Scatter(x=compact(x), y=compact(course.value[kept]), mode="lines", line=line, name=name, showlegend=first),
    ]


def _choose(
    figure: go.Figure,
    recordings: Sequence[str],
    shown: Sequence[str],
    shapes: Mapping[str, list[dict[str, object]]] | None = None,
) -> None:
    """Add the choice of a recording above a figure; ``shown`` tells which recording each trace belongs to."""
    if len(recordings) < 2:
        return
    buttons = [
        {
            "label": recording,
            "method": "update",
            "args": [
                {"visible": [each == recording for each in shown]},
                {} if shapes is None else {"shapes": shapes[recording]},
            ],
        }
        for recording in recordings
    ]
    menu = {"buttons": buttons, "x": 0, "xanchor": "left", "y": 1, "yanchor": "bottom", "pad": {"b": 8}}
    figure.update_layout(updatemenus=[menu])


def error_spectrum_figure(name: str, spectrum: ErrorSpectrum, unit: str, band_hz: Interval | None) -> Figure:
    """Draw the error's density before and after, with the floor and the band that holds most of the mismatch."""
    figure = go.Figure()
    lines = [("nominal re-tuned", spectrum.before, Style.BEFORE)]
    if not np.array_equal(spectrum.before, spectrum.after):
        lines.append(("augmented", spectrum.after, Style.AFTER))
    for label, values, style in lines:
        colour, width, _ = style.value
        line = {"color": colour, "width": width + 0.4}
        figure.add_trace(go.Scatter(x=spectrum.frequency_hz, y=values, mode="lines", line=line, name=label))
    ends = spectrum.frequency_hz[[0, -1]]
    if spectrum.floor > 0.0:
        figure.add_trace(go.Scatter(x=ends, y=[spectrum.floor] * 2, mode="lines", line=FLOOR, name="noise floor"))
    if band_hz is not None and band_hz[0] > 0.0:
        figure.add_vrect(x0=band_hz[0], x1=band_hz[1], fillcolor=SHADE, opacity=0.18, line_width=0, layer="below")
    figure.update_xaxes(title_text="frequency [Hz]", **DECADES)
    figure.update_yaxes(title_text=f"error [{unit}/√Hz]", **DECADES)
    return figure_block(figure, name, PANEL_PX + 40 + LEGEND_PX)


def response_figure(name: str, responses: Mapping[str, Response]) -> Figure:
    """Draw the response of a recording with its confidence, and of both models, one recording at a time."""
    figure = bode.panels()
    recordings, shown = list(responses), list[str]()
    for recording, response in responses.items():
        _response(figure, response)
        for trace in figure.data[len(shown) :]:
            trace.visible = recording == recordings[0]
            shown.append(recording)
    bode.fix_scale(figure, [each.before for each in responses.values()] + [each.after for each in responses.values()])
    _choose(figure, recordings, shown)
    return figure_block(figure, name, bode.HEIGHT_PX + CHOICE_PX, top_px=34 + CHOICE_PX)


def _response(figure: go.Figure, response: Response) -> None:
    seen = np.isfinite(response.std) & (np.abs(response.measured) > 0.0)
    f = response.frequency_hz
    bode.estimate(
        figure, f[seen], response.measured[seen], response.std[seen], response.coherence[seen], GREY,
        "estimate without a model, 95 %",
    )  # fmt: skip
    models = [("nominal re-tuned", response.before, Style.BEFORE)]
    if not np.array_equal(response.before, response.after):
        models.append(("augmented", response.after, Style.AFTER))
    for label, values, style in models:
        there = np.abs(values) > 0.0
        bode.curve(figure, f[there], values[there], label, {"color": style.value[0], "width": 2.0})
