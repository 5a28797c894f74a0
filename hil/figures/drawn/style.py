"""How printed figures look, and how they become files.

Sizes are those of a two-column conference page: 182 mm wide, text of 8 points as in its captions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from hil.errors import UsageError

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


def require_matplotlib() -> None:
    """Refuse before anything is driven where there is nothing to draw with."""
    try:
        import matplotlib  # noqa: F401
    except ModuleNotFoundError as error:
        raise UsageError(
            "figures: expected matplotlib to draw them with, it is not installed. Install it: pip install matplotlib"
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
    """Return what writes a figure in every format, by file name, for `hil.report.outputs.publish`."""

    def writer(suffix: str) -> Callable[[Path], object]:
        def write(path: Path) -> None:
            with drawing():
                draw().savefig(path, format=suffix, metadata=dict(NO_DATE[suffix]))

        return write

    return {f"{name}.{suffix}": writer(suffix) for suffix in FORMATS}


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
