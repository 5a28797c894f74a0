"""A model as the text of a model file: TOML with units in comments."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import tomlkit
from tomlkit.items import InlineTable, Table

from estimator.physics.model import DrivelineModel, Load, parameter_unit
from hil.config.file_schema import FileKind, schema_line
from hil.config.laws import LawTable
from hil.config.model_tables import SCHEMA, Prepared
from hil.recording.signals_config import SignalsConfig


def as_toml(
    model: DrivelineModel,
    signals: SignalsConfig | None,
    laws: Mapping[str, LawTable],
    prepared: Prepared | None = None,
) -> str:
    """Return the text of a model file; an interval that is not finite is left out."""
    document = tomlkit.document()
    document["schema"] = SCHEMA
    document["structure"] = model.structure.value
    document["motion"] = model.motion.value
    parameters = tomlkit.table()
    for name in model.structure.parameter_names:
        parameter = model.parameters[name]
        entry = {"value": float(parameter.value), "tolerance": float(parameter.tolerance)}
        parameters[name] = _inline(entry).comment(parameter_unit(name, model.motion))
    document["parameters"] = parameters
    if model.gear_ratio is not None:
        document["geometry"] = {"gear_ratio": float(model.gear_ratio)}
    if model.load is not Load.OWN:
        constant = model.load.value if isinstance(model.load, Load) else float(model.load)
        document["load"] = {"constant": constant}
    if model.effects:
        document["effects"] = _effects_table(model)
    if laws:
        document["laws"] = _laws_table(laws)
    if signals is not None:
        document["signals"] = _signals_table(signals)
    if prepared is not None:
        document["prepared"] = _prepared_table(prepared)
    return f"{schema_line(FileKind.MODEL)}\n{tomlkit.dumps(document)}"


def _effects_table(model: DrivelineModel) -> Table:
    effects = tomlkit.table(is_super_table=True)
    for name, values in model.effects.items():
        effect = tomlkit.table()
        for key, value in values.items():
            entry: dict[str, Any] = {"value": float(value.value)}
            if value.ci95 is not None and all(math.isfinite(bound) for bound in value.ci95):
                entry["ci95"] = [float(bound) for bound in value.ci95]
            if value.tolerance > 0:
                entry["tolerance"] = float(value.tolerance)
            effect[key] = _inline(entry)
        effects[name] = effect
    return effects


def _laws_table(laws: Mapping[str, LawTable]) -> Table:
    tables = tomlkit.table(is_super_table=True)
    for name, law in laws.items():
        table = tomlkit.table()
        table.update({"function": law.function, "element": law.element, "folder": law.folder})
        table["parameters"] = {key: _inline(parameter.model_dump()) for key, parameter in law.parameters.items()}
        tables[name] = table
    return tables


def _signals_table(signals: SignalsConfig) -> Table:
    """Write the keys that were given, in the contract's way: one inline table each."""
    table = tomlkit.table()
    given = signals.model_dump(mode="json", exclude_unset=True, exclude_none=True)
    for key, value in given.items():
        if isinstance(value, list):
            rows = tomlkit.array()
            rows.extend([_inline(entry) for entry in value])
            table[key] = rows
        else:
            table[key] = _inline(value) if isinstance(value, dict) else value
    return table


def _prepared_table(prepared: Prepared) -> Table:
    table = tomlkit.table()
    table.comment("what was done to the recordings before the fit; hil simulate and hil compare do it again")
    table.update({"mended": prepared.mended, "one_in": prepared.one_in})
    recordings = tomlkit.array().multiline(True)
    recordings.extend([_inline(each.model_dump(exclude_defaults=True)) for each in prepared.recordings])
    table["recordings"] = recordings
    return table


def _inline(entry: Mapping[str, Any]) -> InlineTable:
    inline = tomlkit.inline_table()
    inline.update(entry)
    return inline
