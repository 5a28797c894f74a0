"""The model file, ``hil.model/1``: a driveline as a person writes it down, and as a diagnosis hands it back.

What a file may hold is in the contract; what makes a model is in ``estimator.physics.model``. Faults of both
kinds are reported together, so that a file is fixed in one go: a value of the wrong type is replaced by a
neutral one while the rest of the model is checked.
"""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

import tomlkit
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from tomlkit.items import InlineTable, Table

from estimator.errors import BadModel
from estimator.physics.law_name import LawName
from estimator.physics.model import DrivelineModel, EffectValue, Load, Motion, Parameter, Structure, parameter_unit
from hil.config.file_schema import FileKind, schema_line
from hil.config.laws import LawTable, laws_of, moved
from hil.errors import ModelFileError
from hil.problems import Fault, problem_lines, read_toml, refuse
from hil.recording import columns
from hil.recording.signals_config import SignalsConfig

Kind = TypeVar("Kind", bound=Enum)
Default = TypeVar("Default", float, None)

SCHEMA = "hil.model/1"

NEUTRAL = 1.0
"""Stands for a number of the wrong type while the rest is checked: allowed for every parameter."""


class _Strict(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class _Entry(_Strict):
    value: float

    @model_validator(mode="before")
    @classmethod
    def _is_a_table(cls, entry: object) -> object:
        if not isinstance(entry, Mapping):
            raise ValueError(f"a table of {', '.join(cls.model_fields)}, such as {{ value = 1.5, ... }}")
        return entry


class _ParameterEntry(_Entry):
    tolerance: float


class _EffectEntry(_Entry):
    ci95: Annotated[list[float], Field(min_length=2, max_length=2)] | None = None
    tolerance: float = 0.0

    @model_validator(mode="after")
    def _interval_is_ordered(self) -> Self:
        if self.ci95 and self.ci95[0] > self.ci95[1]:
            refuse([Fault("ci95", "the lower bound first", self.ci95)])
        return self


class _Geometry(_Strict):
    gear_ratio: float = Field(gt=0)


class _Load(_Strict):
    constant: Literal["own", "shared"] | float = "own"


class PreparedRecording(_Strict):
    """A recording that was used.

    Attributes
    ----------
    sha256 : str
        Of its file; empty where it was not read from one.
    samples_used : int
        How many of its samples counted.
    events : dict
        From when to when each event was found in it, since it began [s].
    """

    name: str
    sha256: str
    samples_used: int
    events: dict[str, Annotated[list[float], Field(min_length=2, max_length=2)]] = {}


class Prepared(_Strict):
    """What ``hil diagnose`` did to recordings before it fitted: ``hil simulate`` and ``hil compare`` do it again.

    Attributes
    ----------
    fixed : bool
        Whether wrapped positions are put together, and what was cut off, held or interpolated does not count.
    one_in : int
        To one in how many samples recordings are thinned.
    """

    mended: bool = True
    one_in: int = Field(default=1, ge=1)
    recordings: list[PreparedRecording] = []


class ModelDocument(_Strict):
    """The file's tables, before the model is made of them."""

    schema_: Literal["hil.model/1"] = Field(alias="schema")
    structure: Annotated[Structure, Field(strict=False)]
    motion: Annotated[Motion, Field(strict=False)] = Motion.ROTATION
    parameters: dict[str, _ParameterEntry]
    geometry: _Geometry | None = None
    load: _Load | None = None
    effects: dict[str, dict[str, _EffectEntry]] = {}
    laws: dict[str, LawTable] = {}
    signals: SignalsConfig | None = None
    prepared: Prepared | None = None


@dataclass(frozen=True, slots=True)
class ModelFile:
    """A model and, where the file has them, the way its recordings are read and prepared, and a user's own laws."""

    model: DrivelineModel
    signals: SignalsConfig | None = None
    laws: Mapping[str, LawTable] = field(default_factory=dict)
    prepared: Prepared | None = None

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
    known = {} if document is not None and trust_laws else _table(content.get("laws"))
    try:
        model = _model(content, laws, without=known)
    except BadModel as error:
        problems += str(error).splitlines()
    if document is None or model is None or problems:
        raise ModelFileError(path, *problems)
    return ModelFile(model, document.signals, moved(document.laws, path), document.prepared)


class _SignalsDocument(BaseModel):
    model_config = ConfigDict(strict=True, extra="ignore", frozen=True)

    signals: SignalsConfig


def read_signals(path: Path) -> SignalsConfig:
    """Read the ``[signals]`` of a file that may hold more, such as a model.

    Raises
    ------
    ModelFileError
        With one line for every fault.
    """
    try:
        return _SignalsDocument.model_validate(read_toml(path, ModelFileError)).signals
    except ValidationError as error:
        raise ModelFileError(path, *problem_lines(_SignalsDocument, error)) from error


def signals_of(text: str) -> SignalsConfig:
    """Return what a ``[signals]`` table says."""
    return _SignalsDocument.model_validate(tomllib.loads(text)).signals


def read_model_for_recordings(path: Path | str, trust_laws: bool = False) -> ModelFile:
    """Read a model file that recordings are to be held against.

    Raises
    ------
    ModelFileError
        As `read_model`; also if the model is of a translation and would be held against the motor speed of a
        rig's own recording, or of a joint whose imposed motion is not named.
    """
    file = read_model(path, trust_laws)
    if file.on_bench:
        if file.signals is None or not file.signals.names_bench:
            raise ModelFileError(
                path,
                "signals | expected position (the imposed motion) and torque or force (what it takes) for a joint | "
                "got neither or one of them: name both columns in [signals]",
            )
        return file
    names_output = file.signals is not None and file.signals.names_output
    if file.model.motion is Motion.TRANSLATION and not names_output:
        raise ModelFileError(
            path,
            f"motion | expected 'rotation', since recordings are read by their {columns.SPEED} where [signals] names "
            "no speed, position or force | got 'translation': correct it, or name the column in [signals]",
        )
    return file


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
    path = Path(path)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_text(_as_toml(model, signals, laws or {}, prepared), encoding="utf-8")
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _model(
    content: Mapping[str, Any], laws: tuple[LawName, ...], without: Collection[str] = ()
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
            name: Parameter(_number(entry, "value", NEUTRAL), _number(entry, "tolerance", 0.0))
            for name, entry in _table(content.get("parameters")).items()
        },
        effects={
            name: {key: _effect_value(entry) for key, entry in _table(values).items()}
            for name, values in _table(content.get("effects")).items()
            if name not in without
        },
        gear_ratio=_number(content.get("geometry"), "gear_ratio", None),
        load=_load(content.get("load")),
        laws=laws,
    )


def _load(table: object) -> Load | float:
    """Return whose the constant load torque is, or what it is."""
    given = _number(table, "constant", None)
    return _member(Load, _table(table).get("constant")) or Load.OWN if given is None else given


def _member(kind: type[Kind], value: object) -> Kind | None:
    return next((member for member in kind if member.value == value), None)


def _table(value: object) -> Mapping[str, object]:
    return value if isinstance(value, dict) else {}


def _number(entry: object, key: str, otherwise: Default) -> float | Default:
    value = _table(entry).get(key)
    if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
        return float(value)
    return otherwise


def _effect_value(entry: object) -> EffectValue:
    value, tolerance = _number(entry, "value", NEUTRAL), _number(entry, "tolerance", 0.0)
    match _table(entry).get("ci95"):
        case [int() | float() as low, int() | float() as high]:
            return EffectValue(value, (float(low), float(high)), tolerance)
    return EffectValue(value, None, tolerance)


def _as_toml(
    model: DrivelineModel,
    signals: SignalsConfig | None,
    laws: Mapping[str, LawTable],
    prepared: Prepared | None = None,
) -> str:
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
