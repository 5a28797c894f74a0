"""Frequency responses of identified models: of one experiment, or of several."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from estimator.identification.linear_model import ComplexArray
from estimator.identification.offline.fits import LinearFit
from estimator.signals.record import FloatArray, IntArray
from hil.figures.local_model import LocalModel
from hil.figures.palette import BLACK, BLUE, GREY, VERMILION, series_colour
from hil.report.bode import HEIGHT_PX, curve, estimate, fix_scale, panels
from hil.report.figures import figure_block
from hil.report.page import Figure

LOWEST_HZ = 0.5
"""Below, the high-pass has taken away what the models could be held against."""

HIGHEST_HZ = 50.0
"""Above there are no resonances of drivelines."""

POINTS = 300


def response_figure(name: str, model: LocalModel, best: LinearFit | None = None) -> Figure:
    """Draw one experiment: spectral estimate and models with their 95 % intervals, and the reference."""
    figure = panels()
    f = frequencies_hz(model)
    _spectral(figure, model, GREY, "spectral estimate, 95 %", band=True)
    if best is not None:
        look = {"color": BLACK, "width": 2.2}
        curve(figure, f, best.model.response(f), "best: Box-Jenkins, 95 %", look, fit=best)
    batch = model.found.batch.model
    curve(figure, f, batch.response(f), "output error", {"color": VERMILION, "dash": "dash"})
    below = f[f <= 0.5 / model.online.sample_time_s]
    curve(figure, below, model.online.response(below), "on line", {"color": BLUE, "width": 2.2})
    _reference(figure, model, f)
    fix_scale(figure, _levels([model]))
    return figure_block(figure, name, HEIGHT_PX)


def responses_figure(name: str, models: Sequence[LocalModel]) -> Figure:
    """Draw the on-line models of several experiments over their spectral estimates, as the paper's Fig. 4 does.

    The off-line models wait in the legend.
    """
    figure = panels()
    for number, model in enumerate(models):
        colour, f = series_colour(number), frequencies_hz(model)
        _spectral(figure, model, colour, f"{model.name}, spectral", band=False)
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


def _spectral(figure: go.Figure, model: LocalModel, colour: str, name: str, *, band: bool) -> None:
    found, shown = model.found.spectral, _shown(model)
    if found is not None:
        seen = (found.response[shown], found.magnitude_std[shown], found.coherence[shown])
        estimate(figure, found.frequency_hz[shown], *seen, colour, name, band=band)
