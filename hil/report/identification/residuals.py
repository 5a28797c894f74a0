"""What a model leaves: correlations by lag with their bounds, by plotly."""

from __future__ import annotations

from collections.abc import Sequence

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from estimator.identification.offline.validation import CorrelationTest, Validation
from hil.figures.palette import BLUE, GREY, VERMILION, faded
from hil.report.figures import figure_block
from hil.report.page import Figure

PANEL_PX, AROUND_PX = 160, 140


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
