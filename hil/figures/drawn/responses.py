"""Fig. 4: frequency responses of the on-line models against spectral estimates of the same data, and the truth."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.figures.drawn.style import WIDTH_IN, label_panel
from hil.figures.local_model import LocalModel, decibels, degrees
from hil.figures.numbers import mode_text
from hil.figures.palette import BLACK, BLUE, PALE, VERMILION

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = 4
BLOCK_HEIGHT_IN = 2.9
LEGEND_HEIGHT_IN = 0.3

LOWEST_HZ = 0.5
"""Below, the high-pass has taken away what the models could be held against."""

POINTS = 400

PHASE_TICKS_DEG = (-180.0, -90.0, 0.0, 90.0, 180.0)

EDGE_SHARE, LABEL_SHARE = 0.04, 0.2
"""Of a scale's range: free at its ends, and above where the panel's name stands."""

CONFIDENCE = 1.96
"""Standard deviations of a 95 % interval."""


def responses_figure(models: Sequence[LocalModel]) -> Figure:
    """Draw magnitude above phase for each experiment, four in a row."""
    from matplotlib.figure import Figure

    columns = min(COLUMNS, len(models))
    blocks = -(-len(models) // columns)
    figure = Figure(figsize=(WIDTH_IN, blocks * BLOCK_HEIGHT_IN + LEGEND_HEIGHT_IN))
    heights = [1.5, 1.0] * blocks
    axes = figure.subplots(2 * blocks, columns, sharex=True, squeeze=False, height_ratios=heights)
    for spare in axes.reshape(blocks, 2, columns)[-1][:, len(models) - columns * (blocks - 1) :].ravel():
        spare.axis("off")
    for number, model in enumerate(models):
        block, column = divmod(number, columns)
        _one(axes[2 * block][column], axes[2 * block + 1][column], model)
    _share_scale(axes[0::2], "magnitude [dB]")
    _share_scale(axes[1::2], "phase [°]", PHASE_TICKS_DEG)
    for column in range(columns):
        axes[-1][column].set_xlabel("frequency [Hz]")
    handles, labels = axes[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return figure


def _one(magnitude: Axes, phase: Axes, model: LocalModel) -> None:
    nyquist_hz = 0.5 / model.online.sample_time_s
    f = np.geomspace(LOWEST_HZ, nyquist_hz, POINTS)
    curves: list[tuple[str, Any, dict[str, Any]]] = [
        ("on-line model (OEFO)", model.online.response(f), {"color": BLUE, "linewidth": 1.3}),
        ("off-line model", model.found.batch.model.response(f), {"color": VERMILION, "dashes": (3.0, 1.5)}),
    ]
    if model.reference is not None:
        truth = model.reference_response(f)
        curves.append((model.reference.name, truth, {"color": BLACK, "dashes": (1.0, 1.5)}))
    _spectral(magnitude, phase, model)
    for name, response, look in curves:
        magnitude.plot(f, decibels(response), label=name, **look)
        phase.plot(f, degrees(response), **look)
    label_panel(magnitude, f"{model.name}\n{mode_text(model.found.online_resonance)}")
    magnitude.set_xscale("log")
    magnitude.set_xlim(LOWEST_HZ, nyquist_hz)
    ticks = [tick for tick in (0.5, 1.0, 2.0, 5.0, 10.0, 20.0) if tick < nyquist_hz]
    for axes in (magnitude, phase):
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.minorticks_off()


def _spectral(magnitude: Axes, phase: Axes, model: LocalModel) -> None:
    """Draw the spectral estimate with its 95 % interval, where the data say anything at all."""
    estimate = model.found.spectral
    if estimate is None:
        return
    seen = np.isfinite(estimate.magnitude_std) & (estimate.frequency_hz >= LOWEST_HZ)
    f, size = estimate.frequency_hz[seen], np.abs(estimate.response[seen])
    relative = CONFIDENCE * estimate.magnitude_std[seen] / size
    centre = decibels(estimate.response[seen])
    # The interval is one of the logarithm, which keeps its lower end above zero.
    half_db = 20.0 / np.log(10.0) * relative
    magnitude.fill_between(f, centre - half_db, centre + half_db, color=PALE, alpha=0.5, linewidth=0)
    magnitude.plot(f, centre, ".", color="#8a929b", markersize=2.5, label="spectral estimate, 95 %")
    angle = np.rad2deg(np.angle(estimate.response[seen]))
    phase.fill_between(
        f, angle - np.rad2deg(relative), angle + np.rad2deg(relative), color=PALE, alpha=0.5, linewidth=0
    )
    phase.plot(f, angle, ".", color="#8a929b", markersize=2.5)


def _share_scale(rows: Iterable[Sequence[Axes]], title: str, ticks: Sequence[float] = ()) -> None:
    """Give panels of one kind one scale, from their lines alone: an interval without end is cut off.

    ``ticks`` are those of a scale whose ends are known.
    """
    rows = list(rows)
    panels = [axes for row in rows for axes in row]
    values = np.concatenate([line.get_ydata() for axes in panels for line in axes.get_lines()])
    low, high = (min(ticks), max(ticks)) if ticks else (float(np.nanmin(values)), float(np.nanmax(values)))
    room = LABEL_SHARE if not ticks else EDGE_SHARE
    for axes in panels:
        axes.set_ylim(low - EDGE_SHARE * (high - low), high + room * (high - low))
        axes.tick_params(labelleft=any(axes is row[0] for row in rows))
        if ticks:
            axes.set_yticks(ticks)
    for row in rows:
        row[0].set_ylabel(title)
