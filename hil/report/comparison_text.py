"""A comparison on the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.markup import escape
from rich.table import Table

from estimator.physics.model import unit
from hil.report.comparison import Comparison, by_output, shown_error, together
from hil.report.numbers import shown, shown_p


def comparison_summary(comparisons: Sequence[Sequence[Comparison]]) -> Table:
    """Return one line per recording, model and output, and one of all recordings for each model and output."""
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
        for each in (output for of_model in of_recording for output in of_model.outputs):
            table.add_row(each.record.name, *((each.model,) if several else ()), *_figures(each, first.unit))
    if len(comparisons) > 1:
        for of_model in zip(*comparisons, strict=True):
            for label, of in by_output(of_model).items():
                rms = shown_error(together(of), of[0], first.unit)
                table.add_row(" ".join(("together", label)), *((of[0].model,) if several else ()), rms)
    return table


def _figures(each: Comparison, unit_above: str) -> tuple[str, ...]:
    good, size = int(each.record.okay.sum()), each.record.okay.size
    used = str(size) if good == size else f"{good}/{size}"
    errors = (shown_error(value, each, unit_above) for value in (each.rms, each.largest))
    load = "" if each.record.label else shown(each.load_torque)
    return (*errors, shown(each.fit_percent), load, used, shown_p(each.past_input.p_value))
