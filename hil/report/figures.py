"""Figures of a page, by plotly: signals over time in panels that zoom together, and spectra."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go
import plotly.io
import scipy.signal
from numpy.typing import NDArray
from plotly.subplots import make_subplots
from plotly.utils import PlotlyJSONEncoder

from estimator.signals.record import FloatArray
from hil.figures.palette import BLACK, BLUE, GREEN, GREY, ORANGE, PALE, PURPLE, VERMILION, faded
from hil.report.page import Figure, Paragraph, note

GAP = -32768
"""Stands for a sample that is not there."""

LARGEST = 32700

PAGE_SAMPLES = 3_000_000
"""Samples of a page at most, of all its lines: 8 MB as text."""

EVEN = 1e-3
"""Share of a period that time stamps may be off an even raster."""

SHADE = ORANGE
PANEL_PX = 230
LEGEND_PX = 130
AXIS_TITLE_PX = 54
TOP_PX = 34
DECADES = {"type": "log", "exponentformat": "power", "minor": {"dtick": "D1", "showgrid": True}}
"""A logarithmic axis; its ticks are plotly's own choice: 1, 2 and 5 of each decade where there are few."""

CONFIG = {"responsive": True, "displaylogo": False, "modeBarButtonsToRemove": ["select2d", "lasso2d"]}

SPECTRUM_SEGMENTS = 6
"""A recording is cut into about this many segments for Welch's average, which smooths the spectrum."""

SHORTEST_SEGMENT = 256
LONGEST_SEGMENT = 4096

DRAWN_STRETCHES = 11_000
"""Shared by the recordings of a page: eight lines of two points per stretch keep it under 10 MB."""

LONGEST_STRETCHES = 1500
"""More points than pixels of a wide screen show nothing more."""

TORQUE_NAMES = ("T_M1", "T_M2")


def extremes(y: FloatArray, stretches: int) -> NDArray[np.intp]:
    """Choose which samples of a trace to draw."""
    n = y.shape[0]
    if n <= 2 * stretches:
        return np.arange(n)
    length = -(-n // stretches)
    padded = np.full(stretches * length, np.nan)
    padded[:n] = y
    rows = padded.reshape(stretches, length)
    first = np.arange(stretches) * length
    lowest = first + np.argmin(np.where(np.isnan(rows), np.inf, rows), axis=1)
    highest = first + np.argmax(np.where(np.isnan(rows), -np.inf, rows), axis=1)
    chosen = np.unique(np.concatenate([[0, n - 1], lowest, highest]))
    kept: NDArray[np.intp] = chosen[chosen < n]
    return kept


def packed(time_s: FloatArray, lines: Sequence[FloatArray], recordings: int) -> tuple[dict[str, Any], int]:
    """Return the samples of some lines for `page.js`, and one in how many is there."""
    most = max(PAGE_SAMPLES // max(1, recordings * len(lines)), 2)
    every = -(-time_s.size // most)
    if every > 1:  # the extremes of each stretch on an even raster of half as many stretches
        pairs = [_extremes(y, 2 * every) for y in lines]
        kept = slice(0, pairs[0].size * every, every)
        return _document(time_s[kept][: pairs[0].size], pairs), every
    return _document(time_s, lines), every


def _extremes(y: FloatArray, length: int) -> FloatArray:
    """Return the lowest and the highest sample of every stretch of this length, in the order of time."""
    count = y.size // length
    cut = y[: count * length].reshape(count, length)
    low, high = np.nan_to_num(cut, nan=np.inf).argmin(axis=1), np.nan_to_num(cut, nan=-np.inf).argmax(axis=1)
    order = np.sort(np.column_stack([low, high]), axis=1)
    return np.asarray(np.take_along_axis(cut, order, axis=1).ravel())


def _document(time_s: FloatArray, lines: Sequence[FloatArray]) -> dict[str, Any]:
    step = float(time_s[-1] - time_s[0]) / max(time_s.size - 1, 1)
    is_even = np.abs(time_s - time_s[0] - step * np.arange(time_s.size)).max(initial=0.0) <= EVEN * step
    stamps = {} if is_even else {"stamps": _base64(time_s.astype("<f8"))}
    return {"start": float(time_s[0]), "step": step, "count": time_s.size, **stamps, "lines": [_line(y) for y in lines]}


def _line(y: FloatArray) -> dict[str, Any]:
    there = np.isfinite(y)
    low, high = (float(y[there].min()), float(y[there].max())) if there.any() else (0.0, 0.0)
    middle, scale = 0.5 * (low + high), (0.5 * (high - low) / LARGEST) or 1.0
    codes = np.full(y.size, GAP, dtype="<i2")
    codes[there] = np.round((y[there] - middle) / scale)
    return {"offset": middle, "scale": scale, "codes": _base64(codes)}


def _base64(values: np.ndarray[Any, Any]) -> str:
    return base64.b64encode(values.tobytes()).decode("ascii")


class Mark(NamedTuple):
    """A span of time [s] to shade."""

    from_s: float  # in the time of the figure
    to_s: float  # after `from_s`
    colour: str = ORANGE  # as plotly takes it


class Style(Enum):
    """Colour, width and dash of a line."""

    MEASURED = (PALE, 4.5, "solid")  # wide and pale, under the simulations
    NOMINAL = (GREY, 1.2, "dot")
    BEFORE = (VERMILION, 1.3, "solid")
    AFTER = (BLUE, 1.3, "solid")
    FIRST_INPUT = (BLACK, 1.2, "solid")
    SECOND_INPUT = (GREEN, 1.2, "dash")
    THIRD_INPUT = (PURPLE, 1.2, "dot")
    THIRD_MODEL = (GREEN, 1.3, "solid")
    FOURTH_MODEL = (PURPLE, 1.3, "solid")


plotly.io.templates.default = "none"  # copied into every figure at each change of it; `page.js` gives the look

INPUT_STYLES = (Style.FIRST_INPUT, Style.SECOND_INPUT, Style.THIRD_INPUT)
MODEL_STYLES = (Style.AFTER, Style.BEFORE, Style.THIRD_MODEL, Style.FOURTH_MODEL)


@dataclass(frozen=True, slots=True)
class Curve:
    """One line of a panel; ``y`` has shape (N,), NaN is a gap.

    A ``hidden`` one waits in the legend; one that is ``held`` keeps each value until the next: drawn in steps.
    """

    name: str  # in the legend; lines of one name are shown and hidden together
    y: FloatArray  # over the time of the figure
    style: Style  # of the line
    hidden: bool = False
    held: bool = False


@dataclass(frozen=True, slots=True)
class Panel:
    """Lines that share an axis; ``band`` draws a pair of limits at plus and minus this value."""

    axis: str  # title, with unit
    lines: tuple[Curve, ...]  # drawn in this order, the last on top
    band: float | None = None


def stretches_for(recordings: int) -> int:
    """Return how finely each of so many recordings is drawn; see :func:`hil.report.figures.extremes`."""
    return min(LONGEST_STRETCHES, DRAWN_STRETCHES // max(1, recordings))


def input_lines(torque_nm: FloatArray) -> tuple[Curve, ...]:
    """Name and style the inputs of a recording, which are held over each period; ``torque_nm`` has shape (N, M)."""
    count = torque_nm.shape[1]
    names = TORQUE_NAMES if count == len(TORQUE_NAMES) else [f"input {i + 1}" for i in range(count)]
    return tuple(
        Curve("input" if count == 1 else name, torque_nm[:, i], INPUT_STYLES[i % len(INPUT_STYLES)], held=True)
        for i, name in enumerate(names)
    )


def time_figure(
    name: str,
    time_s: FloatArray,
    panels: Sequence[Panel],
    recordings: int,
    shaded: Sequence[Mark] = (),
) -> list[Paragraph | Figure]:
    """Draw panels over a common time axis; zoomed in, every sample is drawn."""
    stretches = stretches_for(recordings)
    figure = time_panels(time_s, panels, stretches, shaded)
    height_px = PANEL_PX * len(panels) + LEGEND_PX
    for trace in figure.data:
        trace.x = trace.y = None  # `page.js` draws them from the samples, which take a quarter of the room
    samples, every = packed(time_s, [line.y for panel in panels for line in panel.lines], recordings)
    if time_s.size <= 2 * stretches:
        return [figure_block(figure, name, height_px, samples=samples)]
    finest = "every sample" if every == 1 else f"the lowest and the highest of {2 * every} samples"
    drawn = (
        f"Drawn: the lowest and the highest of each {-(-time_s.size // stretches)} samples; zoomed in, {finest}. "
        f"{time_s.size} samples in all."
    )
    return [note(drawn), figure_block(figure, name, height_px, samples=samples)]


def time_panels(time_s: FloatArray, panels: Sequence[Panel], stretches: int, shaded: Sequence[Mark] = ()) -> go.Figure:
    """Return panels over a common time axis; of each line the extremes of so many stretches (``decimate``)."""
    figure = make_subplots(rows=len(panels), cols=1, shared_xaxes=True, vertical_spacing=0.04)
    seen: set[str] = set()
    for row, panel in enumerate(panels, start=1):
        for line in panel.lines:
            kept = extremes(line.y, stretches)
            trace = _scatter(line, time_s[kept], line.y[kept], first=line.name not in seen)
            figure.add_trace(trace, row=row, col=1)
            seen.add(line.name)
        figure.update_yaxes(title_text=panel.axis, row=row, col=1)
        for limit in () if panel.band is None else (-panel.band, panel.band):
            figure.add_hline(y=limit, line={"color": "#777777", "width": 1, "dash": "dot"}, row=row, col=1)
    whole = {"type": "rect", "yref": "paper", "y0": 0.0, "y1": 1.0, "opacity": 0.25, "layer": "below"}
    spans = [{"x0": from_s, "x1": to_s, "fillcolor": colour} for from_s, to_s, colour in shaded]
    figure.update_layout(shapes=[*figure.layout.shapes, *({**whole, **each, "line": {"width": 0}} for each in spans)])
    figure.update_xaxes(title_text="time [s]", row=len(panels), col=1)
    return figure


def spectrum_figure(
    name: str, sample_time_s: float, lines: Sequence[Curve], unit: str, floor: float | None = None
) -> Figure:
    """Draw amplitude spectral densities (Welch, Hann window); a gap counts as zero error.

    ``floor`` is the RMS of white noise, whose density is drawn as a dotted line.
    """
    figure = go.Figure()
    for line in lines:
        length = min(line.y.size, max(SHORTEST_SEGMENT, min(LONGEST_SEGMENT, line.y.size // SPECTRUM_SEGMENTS)))
        frequency, power = scipy.signal.welch(
            np.nan_to_num(line.y), fs=1.0 / sample_time_s, nperseg=length, detrend="constant"
        )
        figure.add_trace(_scatter(line, frequency[1:], np.sqrt(power[1:]), first=True))
    if floor is not None and floor > 0.0:
        level = floor * np.sqrt(2.0 * sample_time_s)
        figure.add_hline(y=level, line={"color": "#777777", "width": 1, "dash": "dot"})
    figure.update_xaxes(title_text="frequency [Hz]", **DECADES)
    figure.update_yaxes(title_text=f"{unit}/√Hz", **DECADES)
    return figure_block(figure, name, PANEL_PX + LEGEND_PX)


def band_figure(name: str, x: FloatArray, y: FloatArray, low: FloatArray, high: FloatArray, axis: str) -> Figure:
    """Draw a course over time with its confidence band; all shapes (K,)."""
    colour, width, _ = Style.AFTER.value
    figure = go.Figure(band(x, low, high, colour))
    figure.add_trace(
        go.Scatter(x=x, y=y, mode="lines", line={"color": colour, "width": width}, name="found, 95 % band")
    )
    figure.update_xaxes(title_text="time [s]")
    figure.update_yaxes(title_text=axis)
    return figure_block(figure, name, PANEL_PX + LEGEND_PX)


def band(
    x: FloatArray, low: FloatArray, high: FloatArray, colour: str, *, shown: bool = False, **group: Any
) -> list[go.Scatter]:
    """Return the area between two courses, in the legend where ``shown``; ``group`` is its name and legend group."""
    edge = {"x": compact(x), "mode": "lines", "line": {"width": 0}, "hoverinfo": "skip", **group}
    area = {"fill": "tonexty", "fillcolor": faded(colour, 0.2), "showlegend": shown}
    return [go.Scatter(y=compact(low), showlegend=False, **edge), go.Scatter(y=compact(high), **edge, **area)]


def compact(values: FloatArray) -> NDArray[np.float32]:
    """Halve what a figure takes up; seven digits are more than a screen shows."""
    return values.astype(np.float32)


def _scatter(line: Curve, x: FloatArray, y: FloatArray, *, first: bool) -> go.Scatter:
    colour, width, dash = line.style.value
    return go.Scatter(
        x=x.astype(np.float32) if x.size > 1 and np.ptp(x) < 1e3 else x,
        y=y.astype(np.float32),
        name=line.name,
        legendgroup=line.name,
        showlegend=first,
        mode="lines",
        line={"color": colour, "width": width, "dash": dash, **({"shape": "hv"} if line.held else {})},
        visible="legendonly" if line.hidden else True,
    )


def figure_block(
    figure: go.Figure,
    name: str,
    height_px: int,
    top_px: int = TOP_PX,
    hover: str = "x unified",
    samples: dict[str, Any] | None = None,
) -> Figure:
    """Return a figure as a block of a page; ``name`` is unique in the page. Its look is `page.js`'s.

    ``hover`` is what a pointer shows: all of one abscissa, or the ``closest`` point. ``samples`` are those to zoom to.
    """
    inside_px = height_px - top_px - LEGEND_PX + TOP_PX
    figure.update_layout(
        height=height_px,
        margin={"l": 64, "r": 12, "t": top_px, "b": LEGEND_PX - TOP_PX},
        legend={"orientation": "h", "yanchor": "top", "y": -AXIS_TITLE_PX / inside_px, "x": 0},
        hovermode=hover,
        font={"family": "system-ui, sans-serif", "size": 13},
    )
    drawn = figure.to_plotly_json()
    drawn["layout"].pop("template", None)
    more = {} if samples is None else {"samples": samples}
    content = _as_text({**drawn, "config": CONFIG, **more})
    return Figure(name, height_px, json.dumps(content, cls=PlotlyJSONEncoder, separators=(",", ":")))


def _as_text(value: Any) -> Any:
    """Return a figure's content with texts that plotly shows as they are: it takes markup in them for its own."""
    if isinstance(value, str):
        return value.replace("<", "&lt;")
    if isinstance(value, Mapping):
        return {key: each if key == "hovertemplate" else _as_text(each) for key, each in value.items()}
    return [_as_text(each) for each in value] if isinstance(value, list | tuple) else value
