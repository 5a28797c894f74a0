"""The log of a search, as ``hil diagnose --explain`` prints it: each set of effects that was fitted, and its end."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from rich.console import RenderableType

from estimator.diagnosis.result import Diagnosis, FittedSet
from estimator.physics.catalogue import title_of
from hil.report import page as html
from hil.report.numbers import shown
from hil.report.terminal import rendered


def search_table(diagnosis: Diagnosis) -> RenderableType:
    """Return a row for each set, the smaller first: what it was started from, its score, its error and its outcome."""
    headings = ("set", "started from", "score", f"error [{diagnosis.fit.unit}]", "outcome")
    about = (
        "Every set of effects that was fitted. Score: minus twice its log-probability, beyond the most probable set's. "
        "Error: of the free run, tuned for it, on samples that no fit has seen; of the sets that were tried so."
    )
    if not diagnosis.effort.sets:
        return rendered([html.paragraph("No set of effects was fitted.")])
    return rendered([html.paragraph(about), html.table(headings, list(_rows(diagnosis.effort.sets)), numbers=(2, 3))])


def _rows(sets: Sequence[FittedSet]) -> Iterator[tuple[str, ...]]:
    for each in sets:
        before = _origin(each) if each.effects else "–"
        numbers = ("–" if math.isnan(value) else shown(value) for value in (each.score, each.rms))
        yield _in_words(each.effects), before, *numbers, each.outcome


def _in_words(effects: Sequence[str]) -> str:
    return ", ".join(map(title_of, effects)) or "nothing"


def _origin(each: FittedSet) -> str:
    """Name the set that one was started from, and what was exchanged, where an effect took another's place."""
    new, gone = set(each.effects) - set(each.started_from), set(each.started_from) - set(each.effects)
    if gone and new:
        return f"{_in_words(each.started_from)}: {_in_words(sorted(gone))} exchanged"
    return _in_words(each.started_from)
