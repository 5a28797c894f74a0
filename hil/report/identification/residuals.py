"""What a model leaves: correlations by lag with their bounds, by plotly."""

from __future__ import annotations

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from estimator.identification.offline.validation import CorrelationTest, Validation
from hil.figures.palette import BLUE, GREY, VERMILION, faded
from hil.report.figures import figure_html

HEIGHT_PX = 620


def residual_figure(name: str, validation: Validation) -> str:
    """Draw residual against past input, against later input, and against itself, over one another."""
    panels = (
        ("with past input", validation.independence, VERMILION),
        ("with later input", validation.feedback, BLUE),
        ("with itself", validation.autocorrelation, GREY),
    )
    titles = [title for title, _, _ in panels]
    figure = make_subplots(rows=len(panels), cols=1, subplot_titles=titles, vertical_spacing=0.13)
    for row, (title, test, colour) in enumerate(panels, start=1):
        _stems(figure, row, title, test, colour)
    figure.update_xaxes(title_text="lag [samples]", row=len(panels), col=1)
    figure.update_annotations(font_size=13, x=0.0, xanchor="left")
    return figure_html(figure, name, HEIGHT_PX, hover="closest")


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
