"""The pictures of a commissioning, from the evidence in its state file: one function per step that has one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from hil.figures.palette import BLUE, GREY, VERMILION, series_colour
from hil.report.figures import DECADES, LEGEND_PX, PANEL_PX, Line, Panel, Style, figure_html, time_figure
from hil.report.identification.pole_map import PoleSet, pole_figure

Evidence = Mapping[str, Any]

COURSES = ("noise", "signs", "friction", "validation")
"""Figures over time that share the page."""


def _array(values: list[float]) -> np.ndarray:
    return np.array(values, dtype=np.float64)


def _noise(evidence: Evidence) -> list[str]:
    course = evidence["course"]
    panel = Panel("speed [rad/s]", (Line("speed at zero torque", _array(course["speed_rad_s"]), Style.AFTER),))
    return [time_figure("noise-course", _array(course["time_s"]), (panel,), len(COURSES))]


def _signs(evidence: Evidence) -> list[str]:
    return [piece for name in ("m1", "m2") if name in evidence for piece in _pulses(name, evidence[name]["course"])]


def _pulses(name: str, course: Mapping[str, list[float]]) -> list[str]:
    panels = (
        Panel(
            "torque [Nm]",
            (
                Line("reading", _array(course["reading_nm"]), Style.MEASURED),
                Line("reference", _array(course["reference_nm"]), Style.FIRST_INPUT),
            ),
        ),
        Panel("speed [rad/s]", (Line("speed", _array(course["speed_rad_s"]), Style.AFTER),)),
    )
    return [f"<h3>Pulses of {name}</h3>", time_figure(f"signs-{name}", _array(course["time_s"]), panels, len(COURSES))]


def _friction(evidence: Evidence) -> list[str]:
    course = evidence["course"]
    panels = (
        Panel("torque [Nm]", (Line("torque of both", _array(course["torque_nm"]), Style.FIRST_INPUT),)),
        Panel("speed [rad/s]", (Line("speed", _array(course["speed_rad_s"]), Style.AFTER),)),
    )
    return [time_figure("friction-course", _array(course["time_s"]), panels, len(COURSES))]


def _identification(evidence: Evidence) -> list[str]:
    runs = evidence["runs"]
    pieces = ["<h3>Frequency responses, torque to speed</h3>", _responses(runs)]
    pieces += ["<h3>Resonance of each run</h3>", _resonances(runs), "<h3>Poles and zeros</h3>"]
    sets = [
        PoleSet(name, _roots(runs, how, "poles"), _roots(runs, how, "zeros"), colour)
        for name, how, colour in (("best off line", "best", BLUE), ("on line, last estimates", "online", VERMILION))
    ]
    pieces.append(pole_figure("identification-poles", sets, runs[0]["online"]["sample_time_s"]))
    return pieces


def _roots(runs: list[Evidence], how: str, which: str) -> np.ndarray:
    """Return the roots of all runs at the on-line period: a pole sampled k times as slowly is its k-th power."""
    k = runs[0]["online"]["sample_time_s"] / runs[0][how]["sample_time_s"]
    return np.array([complex(*root) ** k for run in runs for root in run[how][which]], dtype=np.complex128)


def _responses(runs: list[Evidence]) -> str:
    """Draw every off-line model, over the estimate without a model of the first run, and the coherence below."""
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.05, row_heights=[0.7, 0.3])
    for number, run in enumerate(runs):
        look = {"color": series_colour(number), "width": 1.4}
        line = {"mode": "lines", "line": look, "name": run["run"], "legendgroup": run["run"]}
        figure.add_trace(go.Scatter(x=run["frequency_hz"], y=run["magnitude"], **line), row=1, col=1)
        if run["spectral"] is not None:
            spectral = run["spectral"]
            figure.add_trace(
                go.Scatter(x=spectral["frequency_hz"], y=spectral["coherence"], showlegend=False, **line), row=2, col=1
            )
    if runs[0]["spectral"] is not None:
        spectral = runs[0]["spectral"]
        dots = {"mode": "markers", "marker": {"color": GREY, "size": 5, "symbol": "circle-open"}}
        name = f"without a model, {runs[0]['run']}"
        figure.add_trace(
            go.Scatter(x=spectral["frequency_hz"], y=spectral["magnitude"], name=name, **dots), row=1, col=1
        )
    figure.update_xaxes(**DECADES)
    figure.update_xaxes(title_text="frequency [Hz]", row=2, col=1)
    figure.update_yaxes(title_text="rad/s per Nm", **DECADES, row=1, col=1)
    figure.update_yaxes(title_text="coherence", range=[0.0, 1.05], row=2, col=1)
    return figure_html(figure, "identification-responses", 2 * PANEL_PX + LEGEND_PX)


def _resonances(runs: list[Evidence]) -> str:
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.08)
    names = [run["run"] for run in runs]
    looks = (("best off line", "best", BLUE, "circle"), ("on line", "online", VERMILION, "diamond-open"))
    for name, how, colour, symbol in looks:
        for row in (1, 2):
            values = [None if run[how]["resonance"] is None else run[how]["resonance"][row - 1] for run in runs]
            dots = {"mode": "markers", "marker": {"color": colour, "size": 10, "symbol": symbol}}
            figure.add_trace(
                go.Scatter(x=names, y=values, name=name, legendgroup=name, showlegend=row == 1, **dots), row=row, col=1
            )
    figure.update_yaxes(title_text="resonance [Hz]", row=1, col=1)
    figure.update_yaxes(title_text="damping", row=2, col=1)
    return figure_html(figure, "identification-resonances", 2 * PANEL_PX + LEGEND_PX)


def _validation(evidence: Evidence) -> list[str]:
    worst = evidence["worst"]
    time_s, measured, simulated = (_array(worst[key]) for key in ("time_s", "measured_rad_s", "simulated_rad_s"))
    panels = (
        Panel(
            "speed [rad/s]",
            (Line("measured", measured, Style.MEASURED), Line("simulated", simulated, Style.AFTER)),
        ),
        Panel("error [rad/s]", (Line("error", measured - simulated, Style.BEFORE),)),
    )
    title = f"<h3>Worst of the unseen runs: {worst['name']}</h3>"
    return [title, time_figure("validation-course", time_s, panels, len(COURSES))]


_FIGURES: Mapping[str, Callable[[Evidence], list[str]]] = MappingProxyType(
    {
        "noise": _noise,
        "signs": _signs,
        "friction": _friction,
        "identification": _identification,
        "validation": _validation,
    }
)


def step_figures(step: str, evidence: Evidence) -> list[str]:
    """Return the pictures of a step as pieces of HTML; none where it has none, or left no evidence."""
    return _FIGURES[step](evidence) if step in _FIGURES and evidence else []
