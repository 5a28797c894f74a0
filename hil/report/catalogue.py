"""The catalogue of effects for people and scripts."""

from __future__ import annotations

import difflib
import json
from collections.abc import Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Effect, EffectParameter
from estimator.physics.model import Motion
from hil.errors import UsageError
from hil.report.numbers import json_number, shown
from hil.report.wording import ELEMENTS


def select(name: str | None) -> list[Effect]:
    """Return one entry by name, or all.

    Raises
    ------
    UsageError
        If there is no such entry.
    """
    if name is None:
        return list(EFFECTS.values())
    if name not in EFFECTS:
        near = difflib.get_close_matches(name, EFFECTS, n=1)
        hint = f" Did you mean {near[0]}?" if near else " List them by: hil effects"
        raise UsageError(f"effect {name!r}: expected one of {', '.join(EFFECTS)}.{hint}")
    return [EFFECTS[name]]


def entries_text(entries: Sequence[Effect]) -> str:
    """Return entries as JSON text, schema ``hil.effects/1``."""
    content = {"schema": "hil.effects/1", "effects": [_entry(entry) for entry in entries]}
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _entry(entry: Effect) -> dict[str, Any]:
    return {
        "name": entry.name,
        "element": entry.element.value,
        "title": entry.title,
        "law": entry.law,
        "source": entry.source,
        "excited_by": entry.excited_by,
        "structures": sorted(structure.value for structure in entry.structures),
        "parameters": {parameter.name: _parameter(parameter) for parameter in entry.parameters},
        "resembles": list(entry.resembles),
        "indistinguishable_from": list(entry.equivalent),
        "contains": list(entry.contains),
    }


def _parameter(parameter: EffectParameter) -> dict[str, Any]:
    return {
        "meaning": parameter.meaning,
        "unit": {motion.value: parameter.unit(motion) for motion in Motion},
        "null": json_number(parameter.null),
    }


def catalogue_table(entries: Sequence[Effect]) -> RenderableType:
    """Return the list of entries, one line each."""
    table = Table("effect", "element", "what it is", box=None, pad_edge=False)
    for entry in entries:
        table.add_row(entry.name, ELEMENTS[entry.element], entry.title)
    return table


def effect_details(entry: Effect) -> RenderableType:
    """Return all that is known of one entry."""
    facts = Table.grid(padding=(0, 2))
    for label, text in (
        ("law", entry.law),
        ("source", entry.source),
        ("excited by", entry.excited_by),
        ("structures", ", ".join(sorted(structure.value for structure in entry.structures))),
        ("resembles", ", ".join(entry.resembles)),
        ("same as, in these signals", ", ".join(entry.equivalent)),
        ("contains", ", ".join(entry.contains)),
    ):
        if text:
            facts.add_row(label, Text(text))
    parameters = Table("parameter", "unit", "no effect at", "meaning", box=None, pad_edge=False)
    for parameter in entry.parameters:
        units = dict.fromkeys(parameter.unit(motion) for motion in Motion)
        parameters.add_row(parameter.name, " or ".join(units), shown(parameter.null), Text(parameter.meaning))
    title = Text(f"{entry.name}: {entry.title} ({ELEMENTS[entry.element]})", style="bold")
    return Group(title, facts, Text(""), parameters)
