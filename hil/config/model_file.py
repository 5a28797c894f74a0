"""The model file, ``hil.model/1``: a driveline as a person writes it down, and as a diagnosis hands it back.

What a file may hold is in the contract; what makes a model is in ``estimator.physics.model``. Faults of both
kinds are reported together, so that a file is fixed in one go: a value of the wrong type is replaced by a
neutral one while the rest of the model is checked.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from estimator.errors import BadModel
from estimator.physics.catalogue import BUILT_IN
from estimator.physics.model import DrivelineModel, EffectValue, Load, Motion, Parameter, Prior, Structure
from estimator.physics.own_law import LawName
from estimator.physics.tables import PLACES, PREFIX, TABLES, table_faults
from hil.config.laws import LawTable, laws_of, with_absolute_folders
from hil.config.model_tables import ModelDocument, Prepared, TableEntry, as_toml
from hil.errors import ModelFileError
from hil.files import write_whole
from hil.problems import problem_lines, read_toml
from hil.recording import columns
from hil.recording.signals_config import SignalsConfig

EnumKind = TypeVar("EnumKind", bound=Enum)
Default = TypeVar("Default", float, None)

NEUTRAL = 1.0
"""Stands for a number of the wrong type while the rest is checked: allowed for every parameter of a line."""


@dataclass(frozen=True, slots=True)
class ModelFile:
    """A model and, where the file has them, the way its recordings are read and prepared, and a user's own laws."""

    model: DrivelineModel  # structure, parameters, effects, load and priors of the file
    signals: SignalsConfig | None = None  # [signals]; None: recordings have the columns of this program's own
    laws: Mapping[str, LawTable] = field(default_factory=dict)  # [laws] by name; their folders are absolute
    prepared: Prepared | None = None  # [prepared], what hil diagnose did to recordings before it fitted

    @property
    def on_bench(self) -> bool:
        """True for a joint: its recordings are of an imposed motion and the torque it takes."""
        return self.model.structure is Structure.JOINT

    @property
    def is_foreign(self) -> bool:
        """True for a plant that another program simulates: no file can hold it."""
        return self.model.plant is not None


def read_model(path: Path | str, trust_laws: bool = False) -> ModelFile:
    """Read a model file; its own laws are the model's, and no other model has them.

    Parameters
    ----------
    path
        The file.
    trust_laws
        Whether the code that its ``[laws]`` name may run; a file without any needs no trust.

    Raises
    ------
    ModelFileError
        With one line for every fault: the key, what was expected, what came; also if it has laws and is not trusted.
    """
    path = Path(path)
    content = read_toml(path, ModelFileError)
    problems: list[str] = []
    document = model = None
    try:
        document = ModelDocument.model_validate(content)
    except ValidationError as error:
        problems += problem_lines(ModelDocument, error)
    laws: tuple[LawName, ...] = ()
    try:
        laws = laws_of(path, {} if document is None else document.laws, trust_laws)
    except ModelFileError as error:
        problems += error.problems
    laws_as_data, faults = _tables(content)
    problems += faults
    known = {} if document is not None and trust_laws else _table(content.get("laws"))
    try:
        model = _model(content, laws, laws_as_data, without=known)
    except BadModel as error:
        problems += str(error).splitlines()
    if document is None or model is None or problems:
        raise ModelFileError(path, *problems)
    return ModelFile(model, document.signals, with_absolute_folders(document.laws, path), document.prepared)


class _SignalsDocument(BaseModel):
    model_config = ConfigDict(strict=True, extra="ignore", frozen=True)

    signals: SignalsConfig


def read_signals(path: Path) -> SignalsConfig:
    """Read the ``[signals]`` of a file that may hold more, such as a model."""
    try:
        return _SignalsDocument.model_validate(read_toml(path, ModelFileError)).signals
    except ValidationError as error:
        raise ModelFileError(path, *problem_lines(_SignalsDocument, error)) from error


def signals_of(text: str) -> SignalsConfig:
    """Return what a ``[signals]`` table says."""
    return _SignalsDocument.model_validate(tomllib.loads(text)).signals


def read_model_for_recordings(path: Path | str, trust_laws: bool = False) -> ModelFile:
    """Read a model file that recordings are to be held against."""
    file = read_model(path, trust_laws)
    if file.on_bench:
        _require_bench(path, file.signals)
        return file
    names_output = file.signals is not None and file.signals.names_output
    if file.model.motion is Motion.TRANSLATION and not names_output:
        raise ModelFileError(
            path,
            f"motion | expected 'rotation', since recordings are read by their {columns.SPEED} where [signals] names "
            "no speed, position or force | got 'translation': correct it, or name the column in [signals]",
        )
    return file


def _require_bench(path: Path | str, signals: SignalsConfig | None) -> None:
    """See that the signals of a joint are the imposed motion and what it takes, and no others."""
    if signals is None or not signals.names_bench:
        raise ModelFileError(
            path,
            "signals | expected position (the imposed motion) and torque or force (what it takes) for a joint | "
            "got neither or one of them: name both columns in [signals]",
        )
    if further := signals.further():
        raise ModelFileError(
            path,
            "signals.outputs | expected no further output for a joint, which has one, what the imposed motion takes | "
            f"got {', '.join(repr(each.column) for each in further)}: take it out",
        )


def write_model(
    path: Path | str,
    model: DrivelineModel,
    signals: SignalsConfig | None = None,
    laws: Mapping[str, LawTable] | None = None,
    prepared: Prepared | None = None,
) -> None:
    """Write a model file, whole or not at all; one that is there is replaced.

    An interval that is not finite is left out: a model file holds finite numbers only.
    """
    write_whole(Path(path), as_toml(model, signals, laws or {}, prepared))


def _model(
    content: Mapping[str, Any],
    laws: tuple[LawName, ...],
    tables: Mapping[str, Mapping[str, EffectValue]],
    without: Collection[str] = (),
) -> DrivelineModel | None:
    """Build the model from what is usable of a file's tables; None where not even the structure is known.

    ``without`` names effects that can't be checked, since the laws they are of could not be read.
    """
    structure = _member(Structure, content.get("structure"))
    if structure is None:
        return None
    return DrivelineModel(
        structure=structure,
        motion=_member(Motion, content.get("motion")) or Motion.ROTATION,
        parameters={
            name: Parameter(_number(entry, "value", NEUTRAL), _number(entry, "tolerance", 0.0), _ends(entry, "ci95"))
            for name, entry in _table(content.get("parameters")).items()
        },
        effects={
            name: {key: _effect_value(entry, _null_of(name, key)) for key, entry in _table(values).items()}
            for name, values in _table(content.get("effects")).items()
            if name not in without and name not in TABLES
        }
        | dict(tables),
        gear_ratio=_number(content.get("geometry"), "gear_ratio", None),
        load=_load(content.get("load")),
        laws=laws,
        has=_parts(content.get("machine")),
        priors={name: _prior(entry) for name, entry in _table(content.get("priors")).items() if name not in without},
    )


def _tables(content: Mapping[str, Any]) -> tuple[dict[str, dict[str, EffectValue]], list[str]]:
    """Return the laws without a name as effects, and a line for each fault of the others that no schema knows."""
    found, problems = {}, []
    for place, entry in _table(content.get("tables")).items():
        if place not in PLACES:
            problems.append(f"tables.{place} | expected one of {', '.join(PLACES)} | got {place!r}")
            continue
        try:
            law = TableEntry.model_validate(entry).law(place)
        except ValidationError:  # the document has said what is wrong with it
            continue
        faults = [f"tables.{place}.{key} | expected {expected} | got {got}" for key, expected, got in table_faults(law)]
        problems += faults
        if not faults:
            found[law.name] = law.effect()
    problems += [
        f"effects.{name} | expected it as data | got an effect: write it as [tables.{name.removeprefix(PREFIX)}]"
        for name in _table(content.get("effects"))
        if name in TABLES
    ]
    return found, problems


def _parts(table: object) -> frozenset[str] | None:
    has = _table(table).get("has")
    return frozenset(part for part in has if isinstance(part, str)) if isinstance(has, list) else None


def _prior(entry: object) -> Prior:
    ranges = {name: _ends(entry, name) for name in _table(entry)}
    return Prior(_number(entry, "odds", None), {name: ends for name, ends in ranges.items() if ends is not None})


def _ends(entry: object, key: str) -> tuple[float, float] | None:
    """Return the two ends of an interval; None where there are no two numbers."""
    match _table(entry).get(key):
        case [int() | float() as low, int() | float() as high]:
            return float(low), float(high)
    return None


def _load(table: object) -> Load | float:
    """Return whose the constant load torque is, or what it is."""
    given = _number(table, "constant", None)
    return _member(Load, _table(table).get("constant")) or Load.OWN if given is None else given


def _member(kind: type[EnumKind], value: object) -> EnumKind | None:
    return next((member for member in kind if member.value == value), None)


def _table(value: object) -> Mapping[str, object]:
    return value if isinstance(value, dict) else {}


def _number(entry: object, key: str, otherwise: Default) -> float | Default:
    value = _table(entry).get(key)
    if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
        return float(value)
    return otherwise


def _null_of(effect: str, parameter: str) -> float:
    """Return the value at which an effect's law does nothing: it stands for a number of the wrong type."""
    known = BUILT_IN[effect].parameters if effect in BUILT_IN else ()
    return next((each.null for each in known if each.name == parameter and math.isfinite(each.null)), NEUTRAL)


def _effect_value(entry: object, null: float) -> EffectValue:
    return EffectValue(_number(entry, "value", null), _ends(entry, "ci95"), _number(entry, "tolerance", 0.0))
