"""The paper's figures in print quality, by matplotlib: SVG and PDF, the same bytes from the same data."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from estimator.identification.linear_model import LinearModel
from estimator.signals.record import Record
from hil.errors import UsageError
from hil.figures.local_model import LocalModel, decibels, degrees, mode_text
from hil.figures.palette import BLACK, BLUE, PALE, VERMILION, damping_lines, frequency_marks, series_colour, unit_circle
from hil.version import install_hint

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


WIDTH_IN: Final = 7.16
"""Both columns of a two-column page [inch]."""

FORMATS: Final = ("svg", "pdf")

NO_DATE: Final[Mapping[str, Mapping[str, Any]]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
"""Metadata left out, by format: with a date in it a file would differ from run to run."""

SETTINGS: Final[Mapping[Any, Any]] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # comes with matplotlib: the same picture on every machine
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "legend.fontsize": 7.5,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.0,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "legend.frameon": False,
    "axes.axisbelow": True,
    "pdf.fonttype": 42,  # fonts as a publisher wants them: TrueType, and not as drawings
    "svg.fonttype": "path",
    "svg.hashsalt": "hil",  # names inside an SVG are random otherwise
    "figure.constrained_layout.use": True,
}

SIGNALS_HEIGHT_IN = 3.1

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

POLES_HEIGHT_IN = 3.0
GUIDE = "#c5ccd4"
VIEW = 1.25
"""Half width of the whole map."""

CLOSE_SHARE = 1.4
"""Half width of the close-up, in parts of the largest distance of a pole from their middle."""

LEAST_CLOSE = 0.002
"""Half width of the close-up at least: of one model alone there is no distance."""


def require_matplotlib() -> None:
    """Refuse before anything is driven where there is nothing to draw with."""
    try:
        import matplotlib as mpl  # noqa: F401
    except ModuleNotFoundError as error:
        raise UsageError(
            f"figures: expected matplotlib to draw them with, it is not installed. Install it: {install_hint('paper')}"
        ) from error


@contextmanager
def drawing() -> Iterator[None]:
    """Draw in this style inside the block, whatever the user's own settings of matplotlib are."""
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(dict(SETTINGS))
        yield


def files_of(name: str, draw: Callable[[], Figure]) -> dict[str, Callable[[Path], object]]:
    """Return what writes a figure in every format, by file name, for `hil.result_folder.publish`."""

    def write(suffix: str, path: Path) -> None:
        with drawing():
            draw().savefig(path, format=suffix, metadata=dict(NO_DATE[suffix]))

    return {f"{name}.{suffix}": partial(write, suffix) for suffix in FORMATS}


def label_panel(axes: Axes, text: str) -> None:
    """Write the name of a panel inside its upper left corner, as publishers like it."""
    label = axes.text(
        0.03,
        0.97,
        text,
        transform=axes.transAxes,
        va="top",
        ha="left",
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.8},
    )
    label.set_in_layout(False)  # it lies inside: panels need not make room for it


def signals_figure(records: Sequence[Record]) -> Figure:
    """Draw torque above speed, one column for each recording; the rows have one scale each."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH_IN, SIGNALS_HEIGHT_IN))
    axes = figure.subplots(2, len(records), sharex="col", sharey="row", squeeze=False)
    for column, record in enumerate(records):
        top, bottom = axes[0][column], axes[1][column]
        top.plot(record.time_s, record.total_torque_nm, color=VERMILION, linewidth=0.4)
        bottom.plot(record.time_s, record.output, color=BLUE, linewidth=0.6)
        label_panel(top, f"({'abcdefgh'[column % 8]}) {record.name}")
        bottom.set_xlabel("time [s]")
        bottom.set_xlim(float(record.time_s[0]), float(record.time_s[-1]))
    axes[0][0].set_ylabel(r"$T_\mathrm{tot}$ [Nm]")
    axes[1][0].set_ylabel(r"$\omega_\mathrm{M}$ [rad/s]")
    low, high = axes[0][0].get_ylim()
    axes[0][0].set_ylim(low, high + 0.12 * (high - low))  # room for the panels' names
    return figure


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


def poles_figure(models: Sequence[LocalModel]) -> Figure:
    """Draw the models as identified, their third-order equivalents, and of these the dominant pole close by."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH_IN, POLES_HEIGHT_IN))
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
