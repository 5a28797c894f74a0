"""Frequency responses by plotly: magnitude, phase and coherence over one axis; of one experiment, or of several."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from estimator.identification.linear_model import ComplexArray, LinearModel
from estimator.signals.record import FloatArray, IntArray
from hil.figures.local_model import LocalModel, decibels, degrees
from hil.figures.palette import BLACK, BLUE, GREY, VERMILION, faded, series_colour
from hil.report.figures import DECADES, figure_html

MAGNITUDE, PHASE, COHERENCE = 1, 2, 3
"""Rows of the figure."""

HEIGHT_PX = 760

LOWEST_HZ = 0.5
"""Below, the high-pass has taken away what the models could be held against."""

HIGHEST_HZ = 50.0
"""Above there are no resonances of drivelines."""

POINTS = 300

CONFIDENCE = 1.96
"""Standard deviations of a 95 % interval."""

PHASE_TICKS_DEG = (-180, -90, 0, 90, 180)


def response_figure(name: str, model: LocalModel, best: LinearModel | None = None) -> str:
    """Draw one experiment: spectral estimate with its 95 % interval, the models, and the reference."""
    figure = _panels()
    f = frequencies_hz(model)
    _spectral(figure, model, GREY, "spectral estimate, 95 %", band=True)
    if best is not None:
        _curve(figure, f, best.response(f), "best: Box-Jenkins", {"color": BLACK, "width": 2.2})
    _curve(figure, f, model.found.batch.model.response(f), "output error", {"color": VERMILION, "dash": "dash"})
    below = f[f <= 0.5 / model.online.sample_time_s]
    _curve(figure, below, model.online.response(below), "on line", {"color": BLUE, "width": 2.2})
    _reference(figure, model, f)
    return figure_html(_finished(figure, [model]), name, HEIGHT_PX)


def responses_figure(name: str, models: Sequence[LocalModel]) -> str:
    """Draw the on-line models of several experiments over their spectral estimates, as the paper's Fig. 4 does.

    The off-line models wait in the legend.
    """
    figure = _panels()
    for number, model in enumerate(models):
        colour, f = series_colour(number), frequencies_hz(model)
        _spectral(figure, model, colour, f"{model.name}, spectral", band=False)
        _curve(figure, f, model.online.response(f), model.name, {"color": colour, "width": 2.0})
        offline = model.found.batch.model.response(f)
        look = {"color": colour, "dash": "dash", "width": 1.2}
        _curve(figure, f, offline, "off-line models", look, first=number == 0, hidden=True)
    for number, model in enumerate(models):
        _reference(figure, model, frequencies_hz(model), first=number == 0)
    return figure_html(_finished(figure, models), name, HEIGHT_PX)


def frequencies_hz(model: LocalModel) -> FloatArray:
    """Return the frequencies a model is drawn at, up to half the sampling rate or 50 Hz, shape (M,) [Hz]."""
    return np.geomspace(LOWEST_HZ, min(0.5 / model.found.batch.model.sample_time_s, HIGHEST_HZ), POINTS)


def _panels() -> go.Figure:
    figure = make_subplots(rows=3, cols=1, shared_xaxes=True, vertical_spacing=0.03, row_heights=[0.5, 0.3, 0.2])
    figure.update_yaxes(title_text="magnitude [dB]", row=MAGNITUDE, col=1)
    figure.update_yaxes(title_text="phase [°]", tickvals=PHASE_TICKS_DEG, range=[-190, 190], row=PHASE, col=1)
    figure.update_yaxes(title_text="coherence", range=[0, 1.03], row=COHERENCE, col=1)
    return figure


def _finished(figure: go.Figure, models: Sequence[LocalModel]) -> go.Figure:
    """Fix the scales by the models: the interval of a spectral estimate that says nothing has no end."""
    levels = [decibels(model.online.response(frequencies_hz(model))) for model in models]
    levels += [decibels(m.found.spectral.response[_shown(m)]) for m in models if m.found.spectral is not None]
    low, high = min(float(level.min()) for level in levels), max(float(level.max()) for level in levels)
    figure.update_yaxes(range=[low - 6.0, high + 4.0], row=MAGNITUDE, col=1)
    figure.update_xaxes(**DECADES)
    figure.update_xaxes(title_text="frequency [Hz]", row=COHERENCE, col=1)
    return figure


def _curve(
    figure: go.Figure,
    f: FloatArray,
    response: ComplexArray,
    name: str,
    look: dict[str, Any],
    *,
    first: bool = True,
    hidden: bool = False,
) -> None:
    for row, y in ((MAGNITUDE, decibels(response)), (PHASE, degrees(response))):
        figure.add_trace(
            go.Scatter(
                x=_compact(f),
                y=_compact(y),
                name=name,
                legendgroup=name,
                showlegend=first and row == MAGNITUDE,
                mode="lines",
                line=look,
                visible="legendonly" if hidden else True,
            ),
            row=row,
            col=1,
        )


def _reference(figure: go.Figure, model: LocalModel, f: FloatArray, *, first: bool = True) -> None:
    response = model.reference_response(f)
    if model.reference is not None and response is not None:
        _curve(figure, f, response, model.reference.name, {"color": BLACK, "dash": "dot", "width": 1.4}, first=first)


def _shown(model: LocalModel) -> IntArray:
    """Return the numbers of the spectral estimate's frequencies that are drawn."""
    estimate = model.found.spectral
    if estimate is None:
        return np.empty(0, dtype=np.int64)
    return np.flatnonzero((estimate.frequency_hz >= LOWEST_HZ) & np.isfinite(estimate.magnitude_std))


def _spectral(figure: go.Figure, model: LocalModel, colour: str, name: str, *, band: bool) -> None:
    estimate = model.found.spectral
    if estimate is None:
        return
    shown = _shown(model)
    f, response = estimate.frequency_hz[shown], estimate.response[shown]
    relative = CONFIDENCE * estimate.magnitude_std[shown] / np.abs(response)
    half_db = 20.0 / np.log(10.0) * relative  # an interval of the logarithm: its lower end stays above zero
    angle = np.rad2deg(np.angle(response))
    group = {"legendgroup": name, "name": name}
    if band:
        _band(figure, f, decibels(response), half_db, MAGNITUDE, colour, group)
        _band(figure, f, angle, np.rad2deg(relative), PHASE, colour, group)
    dots = {"mode": "markers", "marker": {"color": colour, "size": 4, "opacity": 0.55}, **group}
    for row, y in ((MAGNITUDE, decibels(response)), (PHASE, angle), (COHERENCE, estimate.coherence[shown])):
        trace = go.Scatter(x=_compact(f), y=_compact(y), showlegend=row == MAGNITUDE and band, **dots)
        figure.add_trace(trace, row=row, col=1)


def _band(
    figure: go.Figure, f: FloatArray, y: FloatArray, half: FloatArray, row: int, colour: str, group: dict[str, str]
) -> None:
    edge = {"mode": "lines", "line": {"width": 0}, "showlegend": False, "hoverinfo": "skip", **group}
    figure.add_trace(go.Scatter(x=_compact(f), y=_compact(y - half), **edge), row=row, col=1)
    area = {"fill": "tonexty", "fillcolor": faded(colour, 0.2)}
    figure.add_trace(go.Scatter(x=_compact(f), y=_compact(y + half), **edge, **area), row=row, col=1)


def _compact(values: FloatArray) -> FloatArray:
    """Halve what a figure takes up; seven digits are more than a screen shows."""
    return values.astype(np.float32)
