"""A comparison on the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table

from hil.report.comparison import Comparison
from hil.report.numbers import shown


def comparison_summary(comparisons: Sequence[Comparison]) -> Table:
    """Return one line per recording."""
    headings = ("free-run simulation", "RMS error", "largest", "NRMSE fit", "load torque", "samples used")
    table = Table(*headings, box=None, pad_edge=False)
    for column in table.columns[1:]:
        column.justify = "right"
    for each in comparisons:
        used = f"{int(each.record.okay.sum())} of {each.record.okay.size}"
        fit = shown(each.fit_percent, "%")
        errors = (shown(each.rms, each.unit), shown(each.largest, each.unit))
        table.add_row(each.record.name, *errors, fit, shown(each.load_torque), used)
    return table
