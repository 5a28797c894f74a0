"""Frequency responses as Bode plots, all of one style: magnitude in dB, phase and coherence over one axis.

An estimate without a model is dots with its 95 % band, a parametric model a line with that of its parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from estimator.identification.linear_model import ComplexArray, LinearModel
from estimator.identification.modes.modes import QUANTILE, propagate
from estimator.identification.offline.fits import LinearFit
from estimator.signals.record import FloatArray, IntArray
from hil.figures.local_model import LocalModel, decibels, degrees
from hil.figures.palette import BLACK, BLUE, GREY, VERMILION, series_colour
from hil.report.figures import DECADES, band, compact, figure_block
from hil.report.page import Figure

MAGNITUDE, PHASE, COHERENCE = 1, 2, 3
"""Rows of the figure."""

HEIGHT_PX = 760
FULL_TURN_DEG = 360.0
PHASE_TICKS_DEG = (-180, -90, 0, 90, 180)
DB_PER_LOG = 20.0 / np.log(10.0)

ROOM_DB = (6.0, 4.0)
"""Below the lowest and above the highest level that is drawn."""

LOWEST_HZ = 0.5
"""Below, the high-pass has taken away what the models could be held against."""

HIGHEST_HZ = 50.0
"""Above there are no resonances of drivelines."""

POINTS = 300


def panels() -> go.Figure:
    """Return an empty figure."""
    figure = make_subplots(rows=3, cols=1, shared_xaxes=True, vertical_spacing=0.03, row_heights=[0.5, 0.3, 0.2])
    figure.update_yaxes(title_text="magnitude [dB]", row=MAGNITUDE, col=1)
    figure.update_yaxes(title_text="phase [°]", tickvals=PHASE_TICKS_DEG, range=[-190, 190], row=PHASE, col=1)
    figure.update_yaxes(title_text="coherence", range=[0, 1.03], row=COHERENCE, col=1)
    figure.update_xaxes(**DECADES)
    figure.update_xaxes(title_text="frequency [Hz]", row=COHERENCE, col=1)
    return figure


def fix_scale(figure: go.Figure, responses: Sequence[ComplexArray]) -> None:
    """Fix the scale by these responses: the band of an estimate that says nothing has no end."""
    levels = np.concatenate([decibels(each[np.abs(each) > 0.0]) for each in responses])
    figure.update_yaxes(range=[levels.min() - ROOM_DB[0], levels.max() + ROOM_DB[1]], row=MAGNITUDE, col=1)


def curve(
    figure: go.Figure,
    f: FloatArray,
    response: ComplexArray,
    name: str,
    look: dict[str, Any],
    *,
    first: bool = True,
    hidden: bool = False,
    fit: LinearFit | None = None,
) -> None:
    """Draw the response of a model, (M,); with the 95 % band of its parameters where it was fitted."""
    if fit is not None and not hidden:
        spread = spread_of(fit, f)
        group = {"legendgroup": name, "name": name}
        _band(figure, f, decibels(response), DB_PER_LOG * spread, MAGNITUDE, look["color"], group)
        _turns(figure, f, np.angle(response), spread, look["color"], group)
    for row, y in ((MAGNITUDE, decibels(response)), (PHASE, degrees(response))):
        figure.add_trace(
            go.Scatter(
                x=compact(f),
                y=compact(y),
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


def spread_of(fit: LinearFit, frequency_hz: FloatArray) -> FloatArray:
    """Return half the 95 % interval of a fitted response's logarithm: of its size, and in radians of its phase, (M,).

    The larger of the two, by the delta method (``propagate``).
    """
    model = fit.model
    known = model.response(frequency_hz)

    def log_gain_and_phase(theta: FloatArray) -> FloatArray:
        ratio = LinearModel.from_theta(theta, model.orders, model.sample_time_s).response(frequency_hz) / known
        return np.concatenate([np.log(np.abs(ratio)), np.angle(ratio)])

    _, covariance = propagate(log_gain_and_phase, model.theta, fit.covariance)
    deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0)).reshape(2, -1)
    return np.asarray(QUANTILE * deviations.max(axis=0), dtype=np.float64)


def estimate(
    figure: go.Figure,
    f: FloatArray,
    response: ComplexArray,
    std: FloatArray,
    coherence: FloatArray,
    colour: str,
    name: str,
    *,
    has_band: bool = True,
) -> None:
    """Draw an estimate without a model, (M,), with the 95 % band of its standard deviation."""
    relative = QUANTILE * std / np.abs(response)
    angle = np.rad2deg(np.angle(response))
    group = {"legendgroup": name, "name": name}
    if has_band:
        _band(figure, f, decibels(response), DB_PER_LOG * relative, MAGNITUDE, colour, group)
        _turns(figure, f, np.angle(response), relative, colour, group)
    dots = {"mode": "markers", "marker": {"color": colour, "size": 4, "opacity": 0.55}, **group}
    for row, y in ((MAGNITUDE, decibels(response)), (PHASE, angle), (COHERENCE, coherence)):
        trace = go.Scatter(x=compact(f), y=compact(y), showlegend=row == MAGNITUDE and has_band, **dots)
        figure.add_trace(trace, row=row, col=1)


def _turns(
    figure: go.Figure, f: FloatArray, angle: FloatArray, half: FloatArray, colour: str, group: dict[str, Any]
) -> None:
    """Draw the band of a phase [rad], once for every turn that it goes through: none crosses the figure."""
    whole = np.rad2deg(np.unwrap(angle))
    for turn in np.unique(np.round(whole / FULL_TURN_DEG)):
        _band(figure, f, whole - turn * FULL_TURN_DEG, np.rad2deg(half), PHASE, colour, group)


def _band(
    figure: go.Figure, f: FloatArray, y: FloatArray, half: FloatArray, row: int, colour: str, group: dict[str, Any]
) -> None:
    figure.add_traces(band(f, y - half, y + half, colour, **group), rows=row, cols=1)


def response_figure(name: str, model: LocalModel, best: LinearFit | None = None) -> Figure:
    """Return the frequency response of one experiment as a block; ``name`` is unique in the page."""
    return figure_block(response(model, best), name, HEIGHT_PX)


def response(model: LocalModel, best: LinearFit | None = None) -> go.Figure:
    """Draw one experiment: spectral estimate and models with their 95 % intervals, and the reference."""
    figure = panels()
    f = frequencies_hz(model)
    _spectral(figure, model, GREY, "spectral estimate, 95 %", has_band=True)
    if best is not None:
        look = {"color": BLACK, "width": 2.2}
        curve(figure, f, best.model.response(f), "best: Box-Jenkins, 95 %", look, fit=best)
    batch = model.found.batch.model
    curve(figure, f, batch.response(f), "output error", {"color": VERMILION, "dash": "dash"})
    below = f[f <= 0.5 / model.online.sample_time_s]
    curve(figure, below, model.online.response(below), "on line", {"color": BLUE, "width": 2.2})
    _reference(figure, model, f)
    fix_scale(figure, _levels([model]))
    return figure


def responses_figure(name: str, models: Sequence[LocalModel]) -> Figure:
    """Draw the on-line models of several experiments over their spectral estimates, as the paper's Fig. 4 does.

    The off-line models wait in the legend.
    """
    figure = panels()
    for number, model in enumerate(models):
        colour, f = series_colour(number), frequencies_hz(model)
        _spectral(figure, model, colour, f"{model.name}, spectral", has_band=False)
        curve(figure, f, model.online.response(f), model.name, {"color": colour, "width": 2.0})
        offline = model.found.batch.model.response(f)
        look = {"color": colour, "dash": "dash", "width": 1.2}
        curve(figure, f, offline, "off-line models", look, first=number == 0, hidden=True)
    for number, model in enumerate(models):
        _reference(figure, model, frequencies_hz(model), first=number == 0)
    fix_scale(figure, _levels(models))
    return figure_block(figure, name, HEIGHT_PX)


def frequencies_hz(model: LocalModel) -> FloatArray:
    """Return the frequencies a model is drawn at, up to half the sampling rate or 50 Hz, shape (M,) [Hz]."""
    return np.geomspace(LOWEST_HZ, min(0.5 / model.found.batch.model.sample_time_s, HIGHEST_HZ), POINTS)


def _levels(models: Sequence[LocalModel]) -> list[ComplexArray]:
    levels = [model.online.response(frequencies_hz(model)) for model in models]
    return levels + [m.found.spectral.response[_shown(m)] for m in models if m.found.spectral is not None]


def _reference(figure: go.Figure, model: LocalModel, f: FloatArray, *, first: bool = True) -> None:
    response = model.reference_response(f)
    if model.reference is not None and response is not None:
        curve(figure, f, response, model.reference.name, {"color": BLACK, "dash": "dot", "width": 1.4}, first=first)


def _shown(model: LocalModel) -> IntArray:
    """Return the numbers of the spectral estimate's frequencies that are drawn."""
    found = model.found.spectral
    if found is None:
        return np.empty(0, dtype=np.int64)
    return np.flatnonzero((found.frequency_hz >= LOWEST_HZ) & np.isfinite(found.magnitude_std))


def _spectral(figure: go.Figure, model: LocalModel, colour: str, name: str, *, has_band: bool) -> None:
    found, shown = model.found.spectral, _shown(model)
    if found is not None:
        seen = (found.response[shown], found.magnitude_std[shown], found.coherence[shown])
        estimate(figure, found.frequency_hz[shown], *seen, colour, name, has_band=has_band)
