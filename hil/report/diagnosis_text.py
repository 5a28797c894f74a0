"""A diagnosis on the terminal: the verdict first, then what it rests on."""

from __future__ import annotations

from types import MappingProxyType

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from estimator.diagnosis.result import Diagnosis, Verdict
from hil.report.numbers import shown, shown_interval, shown_ratio
from hil.report.wording import BADGES, ELEMENTS, belief, headline

_COLOURS = MappingProxyType(
    {
        Verdict.EXPLAINED: "blue",
        Verdict.PARTLY_EXPLAINED: "blue",
        Verdict.UNEXPLAINED: "yellow",
        Verdict.NO_MISMATCH: "green",
    }
)

MOST_RIVALS = 6
"""Rivals that a terminal shows, the nearest first."""


def diagnosis_summary(diagnosis: Diagnosis) -> RenderableType:
    """Return what a terminal shows of a diagnosis."""
    title = Text(f" {BADGES[diagnosis.verdict]} ", style="bold")
    said = Text(f"{headline(diagnosis)}\n\n{diagnosis.statement}")
    pieces: list[RenderableType] = [
        Panel(said, title=title, border_style=_COLOURS[diagnosis.verdict]),
        _fit_table(diagnosis),
    ]
    if diagnosis.effects:
        pieces.append(_effects_table(diagnosis))
    beliefs = [(effect.name, belief(effect).rstrip()) for effect in diagnosis.effects]
    pieces += [Text(f"{name}: {said}") for name, said in beliefs if said]
    pieces.append(_parameter_table(diagnosis))
    pieces += [Text(f"rejected: {rival.name}: {rival.reason}") for rival in diagnosis.rejected[:MOST_RIVALS]]
    if len(diagnosis.rejected) > MOST_RIVALS:
        pieces.append(Text(f"rejected: {len(diagnosis.rejected) - MOST_RIVALS} more, with reasons in the report"))
    pieces += [Text(f"can't tell: {entry.name}: {entry.reason}; {entry.cure}") for entry in diagnosis.untestable]
    pieces += [Text(f"note: {warning}") for warning in diagnosis.warnings]
    return Group(*pieces)


def _table(*headings: str, left: int) -> Table:
    """Make a table whose columns from ``left`` on hold numbers; units in brackets are no markup of rich."""
    table = Table(*(escape(heading) for heading in headings), box=None, pad_edge=False)
    for column in table.columns[left:]:
        column.justify = "right"
    return table


def _fit_table(diagnosis: Diagnosis) -> Table:
    fit = diagnosis.fit
    table = _table("free-run RMS error", f"[{fit.unit}]", "to noise floor", "unseen data", left=1)
    for name, value, unseen in (
        ("nominal as given", fit.nominal, float("nan")),
        ("nominal re-tuned", fit.retuned, fit.holdout_retuned),
        ("augmented", fit.augmented, fit.holdout_augmented),
        ("noise floor", fit.noise_floor, float("nan")),
    ):
        table.add_row(name, shown(value), shown_ratio(value, fit.noise_floor), shown(unseen))
    for each in fit.outputs:
        for name, value in (("re-tuned", each.retuned), ("augmented", each.augmented)):
            what = escape(f"{each.name}, {name} [{each.unit}]")
            table.add_row(what, shown(value), shown_ratio(value, each.noise), "")
    return table


def _effects_table(diagnosis: Diagnosis) -> Table:
    table = _table("found", "element", "parameter", "value", "95 % interval", left=3)
    for effect in diagnosis.effects:
        for name, parameter in effect.parameters.items():
            table.add_row(
                effect.name,
                ELEMENTS[effect.element],
                name,
                shown(parameter.value, parameter.unit),
                shown_interval(parameter.ci95),
            )
    return table


def _parameter_table(diagnosis: Diagnosis) -> Table:
    table = _table("parameter", "nominal", "found", "95 % interval", left=1)
    for name, parameter in diagnosis.parameters.items():
        table.add_row(
            name,
            shown(parameter.nominal, parameter.unit),
            shown(parameter.value),
            shown_interval(parameter.ci95),
        )
    for name, load in diagnosis.load_torque.items():
        table.add_row(f"constant load in {name}", "–", shown(load.value, load.unit), shown_interval(load.ci95))
    return table
