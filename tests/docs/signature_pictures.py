"""The pictures of docs/catalogue.md: what each effect leaves in a recording, and its law.

Run it to draw them anew: ``python -m tests.docs.signature_pictures [NAME ...]``. The same program and matplotlib
release draw the same bytes.
"""

import io
import re
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from estimator.physics.catalogue import EFFECTS
from tests.docs.signatures import SHOWN, Signature, signature

FOLDER = Path(__file__).parents[2] / "docs" / "images" / "effects"

_TOO_FINE = re.compile(r"(?<=[ L])(\d+\.\d)\d+(?=[ \n])")
"""Coordinates beyond a tenth of a point, which nobody sees; they are most of the file."""

WITHOUT, WITH, REST = "#7f7f7f", "#0b5fa5", "#b3401f"
ABOVE = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.0}
"""Where a legend stands in no line's way."""

NOTHING_RAD_S = 1e-6
"""What is left of a recording below this is rounding, and not blown up to fill the panel."""

STYLE = {
    "svg.hashsalt": "effects",  # the names of clip paths, else random
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.0,
    "path.simplify": True,
    "path.simplify_threshold": 0.3,
    "legend.frameon": False,
}


def draw(name: str, shown: Signature) -> Figure:
    """Draw one effect: speed with and without it, what is left, and the law."""
    figure = Figure(figsize=(7.6, 2.7), layout="constrained")
    panels = figure.subplot_mosaic([["speed", "law"], ["rest", "law"]], width_ratios=[2.0, 1.0], height_ratios=[3, 2])
    speed, rest, law = panels["speed"], panels["rest"], panels["law"]
    speed.plot(shown.time_s, shown.without, color=WITHOUT, label="model without it")
    speed.plot(shown.time_s, shown.recorded, color=WITH, label="recorded")
    speed.set_ylabel("speed [rad/s]")
    speed.set_title(f"{SHOWN[name].drive}", loc="left", fontsize=8)
    speed.legend(**ABOVE, ncols=2)
    speed.tick_params(labelbottom=False)
    left = shown.recorded - shown.without
    rest.plot(shown.time_s, left, color=REST)
    if np.nanmax(np.abs(left)) < NOTHING_RAD_S:
        rest.set_ylim(-1.0, 1.0)
    rest.set_ylabel("what is left")
    rest.set_xlabel("time [s]")
    for label, x, y in shown.curve.lines:
        plain = label == "without"
        law.plot(x, y, color=WITHOUT if plain else WITH, ls="--" if label == "5 rad/s" else "-", label=label)
    law.set_xlabel(shown.curve.x_label)
    law.set_ylabel(shown.curve.y_label)
    law.legend(
        loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.0, handlelength=1.2, columnspacing=1
    )
    figure.align_ylabels([speed, rest])
    return figure


def picture(name: str) -> Path:
    """Draw an effect into its file."""
    path = FOLDER / f"{name}.svg"
    with mpl.rc_context(STYLE):
        shown = signature(name)
        assert np.isfinite(shown.without).all()
        text = io.StringIO()
        draw(name, shown).savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    path.write_text(_TOO_FINE.sub(r"\1", text.getvalue()), encoding="utf-8")
    return path


if __name__ == "__main__":
    FOLDER.mkdir(parents=True, exist_ok=True)
    for each in sys.argv[1:] or EFFECTS:
        sys.stdout.write(f"{picture(each)}\n")
