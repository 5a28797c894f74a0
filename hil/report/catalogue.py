"""The catalogue of effects for people and scripts."""

from __future__ import annotations

import difflib
import json
import math
from collections.abc import Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Effect, EffectParameter
from estimator.physics.model import Motion, Structure
from hil.errors import UsageError
from hil.report.numbers import as_json, fields_as_json, json_number
from hil.report.wording import ELEMENTS

SCALES = "Bounds are in multiples of a scale that the recordings give: torque in use, top speed, sampling period."


def select(name: str | None) -> list[Effect]:
    """Return one entry by name, or all."""
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
        **fields_as_json(entry, "name", "element", "title", "law", "source", "excited_by"),
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
        "bounds_in_scales": as_json((parameter.low, parameter.high)),
        "optional": parameter.optional,
        "per_recording": parameter.own,
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
        ("excited by", entry.excited_by),
        ("confused with", ", ".join(entry.resembles)),
        ("the same to torque and speed", ", ".join(entry.equivalent)),
        ("contains", ", ".join(entry.contains)),
        ("structures", structures_text(entry)),
        ("source", entry.source),
    ):
        if text:
            facts.add_row(label, Text(text))
    parameters = Table("parameter", "unit", "null", "bounds", "meaning", box=None, pad_edge=False)
    for parameter in entry.parameters:
        parameters.add_row(
            parameter.name,
            unit_text(parameter),
            null_text(parameter),
            bounds_text(entry, parameter),
            Text(parameter.meaning),
        )
    title = Text(f"{entry.name}: {entry.title} ({ELEMENTS[entry.element]})", style="bold")
    note = Text(f"With all parameters at null there is no effect. {SCALES}", style="dim")
    return Group(title, facts, Text(""), parameters, Text(""), note)


def structures_text(entry: Effect) -> str:
    """Return the structures an effect makes sense in, smallest first."""
    return ", ".join(structure.value for structure in Structure if structure in entry.structures)


def unit_text(parameter: EffectParameter) -> str:
    """Return a parameter's unit for rotation or translation, a dash for a bare number."""
    return " or ".join(dict.fromkeys(parameter.unit(motion) for motion in Motion)) or "–"


def null_text(parameter: EffectParameter) -> str:
    """Return the value without the effect; a limit that is none is infinite."""
    return "∞" if math.isinf(parameter.null) else f"{parameter.null:g}"


def bounds_text(entry: Effect, parameter: EffectParameter) -> str:
    """Return what a fit may try for a parameter."""
    if entry.recognised:
        return "read off the data"
    if entry.event and parameter.own:
        return "in the recording"
    if entry.profile or math.isinf(parameter.high):
        return "free"
    span = f"{parameter.low:g} to {parameter.high:g}"
    return span if parameter.own else f"{span} scales"
