"""A comparison on the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.markup import escape
from rich.table import Table

from estimator.physics.model import unit
from hil.report.comparison import Comparison, together
from hil.report.numbers import shown, shown_p


def comparison_summary(comparisons: Sequence[Sequence[Comparison]]) -> Table:
    """Return one line per recording and model, and one of all recordings for each model."""
    several, first = len(comparisons[0]) > 1, comparisons[0][0]
    load = f"load [{unit('torque', first.motion)}]"
    headings = ("free run", *(("model",) if several else ()), f"RMS [{first.unit}]", "largest", "fit [%]", load,
                "samples", "p, past torque")  # fmt: skip
    table = Table(*(escape(heading) for heading in headings), box=None, pad_edge=False)
    for column in table.columns[2 if several else 1 :]:
        column.justify = "right"
    for column in table.columns[: 2 if several else 1]:
        column.no_wrap = True
    for of_recording in comparisons:
        for each in of_recording:
            table.add_row(each.record.name, *((each.model,) if several else ()), *_figures(each))
    if len(comparisons) > 1:
        for of_model in zip(*comparisons, strict=True):
            rms = shown(together(of_model))
            table.add_row("together", *((of_model[0].model,) if several else ()), rms)
    return table


def _figures(each: Comparison) -> tuple[str, ...]:
    good, size = int(each.record.okay.sum()), each.record.okay.size
    used = str(size) if good == size else f"{good}/{size}"
    figures = (each.rms, each.largest, each.fit_percent, each.load_torque)
    return (*map(shown, figures), used, shown_p(each.past_input.p_value))
