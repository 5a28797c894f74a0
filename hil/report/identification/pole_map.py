"""Poles and zeros in the plane of z by plotly: of several models, with what is known of where they truly are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from estimator.identification.linear_model import ComplexArray
from estimator.signals.record import FloatArray
from hil.figures.local_model import LocalModel
from hil.figures.palette import BLACK, damping_lines, faded, frequency_marks, unit_circle
from hil.report.figures import figure_block
from hil.report.page import Figure

HEIGHT_PX = 640
GUIDE = "#c5ccd4"
MARGIN = 1.25
"""Half width of the first view; zeros far outside are left to zooming."""


@dataclass(frozen=True, slots=True)
class PoleSet:
    """Poles and zeros of one model.

    Attributes
    ----------
    name
        In the legend.
    poles, zeros
        In z.
    colour
        As ``#rrggbb``.
    regions
        Outlines of 95 % confidence regions, each of shape (K, 2).
    reference
        True for one that was not identified but is known: drawn larger and under the others.
    hidden
        Waits in the legend.
    """

    name: str
    poles: ComplexArray
    zeros: ComplexArray
    colour: str
    regions: tuple[FloatArray, ...] = ()
    reference: bool = False
    hidden: bool = False


def pole_figure(name: str, sets: Sequence[PoleSet], sample_time_s: float) -> Figure:
    """Draw poles as crosses and zeros as circles; those of one model share a colour and a legend entry."""
    figure = go.Figure()
    _guides(figure, sample_time_s)
    for each in sorted(sets, key=lambda each: not each.reference):
        _draw(figure, each)
    figure.update_xaxes(title_text="real part", range=[-MARGIN, MARGIN], zeroline=True, constrain="domain")
    figure.update_yaxes(title_text="imaginary part", range=[-MARGIN, MARGIN], scaleanchor="x", zeroline=True)
    figure.update_layout(hovermode="closest")
    return figure_block(figure, name, HEIGHT_PX, hover="closest")


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
