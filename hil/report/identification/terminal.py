"""The table of ``hil identify`` for a terminal."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from rich.box import SIMPLE_HEAD
from rich.table import Table

from estimator.identification.modes.modes import Mode
from estimator.identification.online.recursive import Status
from estimator.identification.study import Compared, Study
from hil.report.identification.wording import plus_minus

NAME_WIDTH = 20
"""Longest name of a recording in the table; a longer one wraps."""


def summary(studies: Sequence[Study], nominal: Mode | None) -> Table:
    """Return each recording's best estimate and on-line estimate; it fits into 80 columns, numbers are never cut.

    The status of the on-line estimates has a column where one of them is not as it should be.
    """
    wrong = any(each.found.estimate.status is not Status.ESTIMATED for each in studies)
    table = Table(title="Resonance and damping", title_justify="left", box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("recording", overflow="fold", max_width=NAME_WIDTH)
    for heading in ("best [Hz]", "damping", "on line", "damping"):
        table.add_column(heading, no_wrap=True, justify="right")
    if wrong:
        table.add_column("on line is", no_wrap=True)
    for each in studies:
        status = [each.found.estimate.status.value] if wrong else []
        table.add_row(each.name, *_known(each), *_shown(each.found.online_resonance), *status)
    if nominal is not None:
        table.add_section()
        table.add_row("model file", *_shown(nominal), "", "")
    return table


def compared_summary(compared: Iterable[Compared]) -> Table:
    """Return what several recursive estimators made of the same data."""
    table = Table(title="Recursive estimators", title_justify="left", box=SIMPLE_HEAD)
    for heading in ("recording", "estimator", "[Hz]", "damping", "fit", "status"):
        table.add_column(heading)
    shown = list(compared)
    for each in shown:
        fit = f"{each.fit_percent:.1f} %" if math.isfinite(each.fit_percent) else "–"
        table.add_row(each.recording, each.estimator, *_shown(each.resonance), fit, each.status.value)
    table.caption = "\n".join(f"{each.recording}, {each.estimator}: {each.reason}" for each in shown if each.reason)
    table.caption_justify = "left"
    return table


def _shown(mode: Mode | None) -> tuple[str, str]:
    return ("none", "") if mode is None else (f"{mode.frequency_hz:.2f}", f"{mode.damping:.3f}")


def _known(each: Study) -> tuple[str, str]:
    mode = each.resonance
    return ("none", "") if mode is None else (plus_minus(mode.frequency_hz), plus_minus(mode.damping))
