"""The pictures of docs/gallery.md: torque and speed of a recording, and what of it is flagged or lacking."""

import io
import re
from collections.abc import Mapping
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from estimator.signals.record import FloatArray
from hil.recording import read_table
from hil.recording.table import Column
from tests.docs.gallery.case import Draw
from tests.docs.signature_pictures import REST, STYLE, WITH, WITHOUT

FOLDER = Path(__file__).parents[3] / "docs" / "images" / "gallery"

_TOO_FINE = re.compile(r"(?<=[ L])(\d+\.\d)\d+(?=[ \n])")


def signals_of(path: Path, other: Path | None = None, until_s: float | None = None) -> Draw:
    """Return what draws a recording, next to the same one without the fault where there is one; read at once."""
    columns = read_table(path).columns
    companion = None if other is None else read_table(other).columns
    time_s = np.asarray(columns["time_s"], dtype=float)
    flags = np.asarray(columns.get("flags", np.zeros(time_s.size))) != 0

    def draw(target: Path) -> None:
        figure = Figure(figsize=(7.6, 2.9), layout="constrained")
        torque, speed = figure.subplots(2, 1, sharex=True)
        if companion is not None:
            for panel, values in (
                (torque, _torque(companion)),
                (speed, np.asarray(companion["speed_rad_s"], dtype=float)),
            ):
                panel.plot(np.asarray(companion["time_s"], dtype=float), values, color=WITHOUT, label="as it should be")
        if companion is None:
            torque.plot(time_s, columns["torque_m1_nm"], color=WITH, label="m1")
            torque.plot(time_s, columns["torque_m2_nm"], color=WITHOUT, ls="--", label="m2")
        else:
            torque.plot(time_s, _torque(columns), color=WITH, label="recorded")
        speed.plot(time_s, np.asarray(columns["speed_rad_s"], dtype=float), color=WITH)
        for panel in (torque, speed):
            for at in time_s[flags]:
                panel.axvline(at, color=REST, lw=0.8, alpha=0.7, label=None if at != time_s[flags][0] else "flagged")
        torque.set_ylabel("torque [Nm]")
        speed.set_ylabel("speed [rad/s]")
        speed.set_xlabel("time [s]")
        torque.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0, ncols=3)
        if until_s is not None:
            speed.set_xlim(time_s[0], until_s)
        figure.align_ylabels([torque, speed])
        _save(figure, target)

    return draw


def _torque(columns: Mapping[str, Column]) -> FloatArray:
    return np.asarray(columns["torque_m1_nm"], dtype=float) + np.asarray(columns["torque_m2_nm"], dtype=float)


def _save(figure: Figure, path: Path) -> None:
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    path.write_text(_TOO_FINE.sub(r"\1", text.getvalue()), encoding="utf-8")


def picture(name: str, draw: Draw) -> Path:
    """Draw a failure into its file."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context({**STYLE, "svg.hashsalt": "gallery"}):
        draw(FOLDER / f"{name}.svg")
    return FOLDER / f"{name}.svg"
