"""Tables of an identification report."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from estimator.identification.offline.orders import OrderChoice
from estimator.identification.study import Compared, Study
from hil.figures.local_model import LocalModel
from hil.report import page as html
from hil.report.identification.wording import plus_minus
from hil.report.numbers import shown, shown_interval

MOST_CANDIDATES = 8
"""Structures shown of an order selection."""


def numbers_table(models: Sequence[LocalModel], studies: Sequence[Study]) -> list[Any]:
    """Return resonance and damping on line and off line, and how well the models do, of every recording."""
    headings = (
        "recording",
        "best [Hz]",
        "damping",
        "on line [Hz]",
        "damping",
        "free-run fit",
        "one step",
        "unseen",
        "status",
    )
    rows = [_numbers(each) for each in studies]
    known = [model for model in models if model.reference_mode is not None]
    if known and (mode := known[0].reference_mode) is not None and known[0].reference is not None:
        rows.append((known[0].reference.name, shown(mode.frequency_hz), shown(mode.damping), "", "", "", "", "", ""))
    note = (
        "Best: the Box-Jenkins model. ± is half the 95 % interval. Free-run fit, of the output-error model: 100 % less "
        "the simulation error over the output's own variation; one step ahead uses the measured output and does not "
        "measure a model. Unseen: free run on the others."
    )
    return [html.table(headings, rows, numbers=range(1, 8)), html.note(note)]


def _numbers(each: Study) -> tuple[str, ...]:
    online, best, own = each.found.online_resonance, each.resonance, each.validation.own
    unseen = [run.fit_percent for run in each.validation.unseen]
    return (
        each.name,
        "–" if best is None else plus_minus(best.frequency_hz),
        "–" if best is None else plus_minus(best.damping),
        "–" if online is None else shown(online.frequency_hz),
        "–" if online is None else shown(online.damping),
        shown(own.fit_percent, "%"),
        shown(own.one_step_fit_percent, "%"),
        shown(sum(unseen) / len(unseen), "%") if unseen else "–",
        each.found.estimate.status.value,
    )


def physical_tables(studies: Sequence[Study]) -> list[Any]:
    """Return the drive's parameters of every recording: one row each, then what is open and why."""
    rows, warnings, is_open = [], [], []
    for each in studies:
        if each.physical is None:
            warnings.append(html.warning(f"{each.name}: no two-mass drive. {each.not_physical}"))
            continue
        both = {**each.physical.parameters, **each.physical.sums}
        rows += [
            html.Row(
                (
                    each.name,
                    name,
                    shown(one.estimate.value),
                    shown_interval(one.estimate.ci95),
                    one.unit,
                    "determined" if one.is_determined else "open",
                ),
                "" if one.is_determined else "undetermined",
            )
            for name, one in both.items()
        ]
        is_open += [html.note(f"{each.name}: {one.statement}") for one in both.values() if not one.is_determined]
    headings = ("recording", "parameter", "value", "95 % interval", "unit", "")
    table = html.table(headings, rows, numbers=(2, 3)) if rows else None
    return [table, *warnings, html.details("What is open, and what would determine it", *is_open) if is_open else None]


def orders_table(choice: OrderChoice) -> list[Any]:
    """Return the best structures of an order selection, the chosen one first."""
    rows = [
        (
            str(each.orders.na),
            str(each.orders.nb),
            str(each.orders.nk),
            shown(each.criterion),
            shown(each.rms),
            shown(each.unseen_fit_percent, "%"),
        )
        for each in choice.candidates[:MOST_CANDIDATES]
    ]
    headings = ("nA", "nB", "delay", "BIC above the best", "RMS of the whitened error", "fit on unseen")
    return [html.paragraph(choice.statement), html.table(headings, rows, numbers=range(6))]


def compared_table(compared: Sequence[Compared]) -> html.Table:
    """Return what several recursive estimators made of the same data."""
    rows = [
        (
            each.recording,
            each.estimator,
            "–" if each.resonance is None else shown(each.resonance.frequency_hz),
            "–" if each.resonance is None else shown(each.resonance.damping),
            shown(each.fit_percent, "%"),
            f"{each.status.value}: {each.reason}" if each.reason else each.status.value,
        )
        for each in compared
    ]
    headings = ("recording", "estimator", "frequency [Hz]", "damping", "free-run fit", "status")
    return html.table(headings, rows, numbers=(2, 3, 4))
