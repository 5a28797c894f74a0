"""Fig. 2: total torque and motor speed of three experiments, as they were recorded."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from estimator.signals.record import Record
from hil.figures.drawn.style import WIDTH_IN, label_panel
from hil.figures.palette import BLUE, VERMILION

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEIGHT_IN = 3.1


def signals_figure(records: Sequence[Record]) -> Figure:
    """Draw torque above speed, one column for each recording; the rows have one scale each."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN))
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
