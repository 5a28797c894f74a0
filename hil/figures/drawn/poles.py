"""Fig. 5: poles and zeros of the models of all experiments, and their third-order equivalents about the resonance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from estimator.identification.linear_model import LinearModel
from hil.figures.drawn.style import WIDTH_IN
from hil.figures.local_model import LocalModel
from hil.figures.palette import BLACK, series_colour
from hil.figures.z_plane import damping_lines, frequency_marks, unit_circle

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HEIGHT_IN = 3.0
GUIDE = "#c5ccd4"
VIEW = 1.25
"""Half width of the whole map."""

CLOSE_SHARE = 1.4
"""Half width of the close-up, in parts of the largest distance of a pole from their middle."""

LEAST_CLOSE = 0.002
"""Half width of the close-up at least: of one model alone there is no distance."""


def poles_figure(models: Sequence[LocalModel]) -> Figure:
    """Draw the models as identified, their third-order equivalents, and of these the dominant pole close by."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN))
    whole, third, close = figure.subplots(1, 3)
    for axes in (whole, third, close):
        _guides(axes, models[0].online.sample_time_s)
        _reference(axes, models)
    for number, model in enumerate(models):
        look = {"color": series_colour(number), "label": model.name}
        _model(whole, model.online, look)
        if (low := model.third_order) is not None:
            _model(third, low, look)
            _model(close, low, look)
    _errors(close, models)
    _view(whole, 0j, VIEW, f"(a) as identified, $n_\\mathrm{{A}}$ = {models[0].online.orders.na}")
    _view(third, 0j, VIEW, "(b) third order")
    _view(close, *_about_dominant(models), "(c) third order, dominant pole")
    whole.set_ylabel("imaginary part")
    handles, labels = whole.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 9), columnspacing=1.0)
    return figure


def _guides(axes: Axes, sample_time_s: float) -> None:
    axes.grid(visible=False)
    axes.plot(*unit_circle(), color="#7c8590", linewidth=0.8)
    for _, x, y in damping_lines():
        axes.plot(x, y, color=GUIDE, linewidth=0.5, dashes=(2.0, 2.0))
    for frequency_hz, z in frequency_marks(sample_time_s):
        axes.plot([0.0, z.real], [0.0, z.imag], color=GUIDE, linewidth=0.4)
        mark = axes.text(
            1.1 * z.real, 1.1 * z.imag, f"{frequency_hz:g} Hz", fontsize=6, color="#5a6470", ha="center", va="center"
        )
        mark.set_clip_on(True)
        mark.set_in_layout(False)
    axes.set_aspect("equal")
    axes.set_xlabel("real part")
    axes.locator_params(nbins=5)


def _model(axes: Axes, model: LinearModel, look: dict[str, Any]) -> None:
    """Draw poles as crosses, zeros as circles."""
    axes.plot(model.poles.real, model.poles.imag, "x", markersize=5, markeredgewidth=1.0, **look)
    zeros = model.zeros
    axes.plot(zeros.real, zeros.imag, "o", markersize=4, markerfacecolor="none", color=look["color"])


def _reference(axes: Axes, models: Sequence[LocalModel]) -> None:
    """Draw what is known of every experiment; payloads differ, and so do the points, a little."""
    look: dict[str, Any] = {"linestyle": "none", "color": BLACK, "markeredgewidth": 0.6}
    label: str | None = None
    for model in models:
        if model.reference is None:
            continue
        label = model.reference.name if label is None else "_"  # matplotlib leaves such labels out of the legend
        line, period_s = model.reference.line, model.online.sample_time_s
        poles, zeros = line.poles(period_s), line.zeros(period_s)
        axes.plot(poles.real, poles.imag, marker="+", markersize=9, label=label, **look)
        axes.plot(zeros.real, zeros.imag, marker="s", markersize=6, markerfacecolor="none", **look)


def _errors(axes: Axes, models: Sequence[LocalModel]) -> None:
    """Join the dominant pole of each model with the one it should be."""
    for model in models:
        found = _dominant(model)
        if found is None or model.reference is None:
            continue
        known = model.reference.line.poles(model.online.sample_time_s)
        true = complex(known[np.argmin(np.abs(known - found))])
        axes.plot([found.real, true.real], [found.imag, true.imag], color="#8a929b", linewidth=0.5, zorder=1)


def _view(axes: Axes, middle: complex, half: float, name: str) -> None:
    axes.set_xlim(middle.real - half, middle.real + half)
    axes.set_ylim(middle.imag - half, middle.imag + half)
    axes.set_title(name, loc="left")


def _about_dominant(models: Sequence[LocalModel]) -> tuple[complex, float]:
    """Return the middle of all dominant poles, and how far to look around; the whole plane where there are none."""
    found = np.array([pole for model in models if (pole := _dominant(model)) is not None])
    if found.size == 0:
        return 0j, VIEW
    middle = complex(found.mean())
    return middle, max(CLOSE_SHARE * float(np.abs(found - middle).max()), LEAST_CLOSE)


def _dominant(model: LocalModel) -> complex | None:
    """Return the upper pole of the third-order equivalent; None where there is none, or it does not oscillate."""
    upper = [] if model.third_order is None else [pole for pole in model.third_order.poles.tolist() if pole.imag > 0.0]
    return upper[0] if upper else None
