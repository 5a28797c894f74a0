"""A model file, ``hil.model/1``, as it is written: its tables, and a model as its text, TOML with units in comments."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, Self

import tomlkit
from pydantic import BaseModel, ConfigDict, Field, model_validator
from tomlkit.items import Array, InlineTable, Table

from estimator.physics.model import DrivelineModel, Load, Motion, Parameter, Structure, parameter_unit, unit
from estimator.physics.tables import PLACES, TABLES, Table as LawAsTable, table_of
from hil.config.laws import LawTable
from hil.config.table import FileKind, schema_line
from hil.problems import Fault, refuse
from hil.recording.signals_config import SignalsConfig

SCHEMA = "hil.model/1"


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


Interval = Annotated[list[float], Field(min_length=2, max_length=2)]


class _EffectEntry(_Entry):
    ci95: Interval | None = None
    tolerance: float = 0.0

    @model_validator(mode="after")
    def _interval_holds_the_value(self) -> Self:
        if self.ci95 and not self.ci95[0] <= self.value <= self.ci95[1]:
            refuse([Fault("ci95", f"the lower bound first, and the value, {self.value:g}, between both", self.ci95)])
        return self


class ParameterEntry(_Entry):
    """A nominal value with the relative tolerance it is trusted to, or the 95 % interval to which it was measured."""

    tolerance: float | None = None  # relative; None with `ci95`
    ci95: Interval | None = None  # [low, high], in the value's unit

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.tolerance is None) == (self.ci95 is None):
            got = "neither" if self.ci95 is None else "both"
            refuse([Fault("tolerance", "what the value is trusted to, or ci95 = [low, high] in its place", got)])
        return self

    def parameter(self) -> Parameter:
        """Return the value with what it is trusted to."""
        return Parameter(self.value, self.tolerance or 0.0, None if self.ci95 is None else (self.ci95[0], self.ci95[1]))


class _Geometry(_Strict):
    gear_ratio: float = Field(gt=0)


class _Load(_Strict):
    constant: Literal["own", "shared"] | float = "own"


Bounds = Annotated[list[float], Field(min_length=2, max_length=2)]


class TableEntry(_Strict):
    """A law without a name, as data: its knots rise, and each has a value (``estimator.physics.tables``)."""

    knots: list[float]  # in the unit of the place
    values: list[float]  # one for each knot [Nm; translation N]
    ci95: list[Bounds] | None = None  # [low, high] of each value
    damping: float = 0.0  # of its own over the rate, with `shaft_twist` alone [Nm s/rad]

    @model_validator(mode="after")
    def _intervals_hold_their_values(self) -> Self:
        pairs = zip(self.ci95 or (), self.values, strict=False)  # that they are as many is seen by `table_faults`
        for i, (band, value) in enumerate(pairs):
            if band[0] <= band[1] and not band[0] <= value <= band[1]:
                refuse([Fault(f"ci95.{i}", f"the value there, {value:g}, between both bounds", band)])
        return self

    def law(self, place: str) -> LawAsTable:
        """Return it as the law at a place."""
        bands = None if self.ci95 is None else tuple((low, high) for low, high in self.ci95)
        return LawAsTable(place, tuple(self.knots), tuple(self.values), bands, self.damping)


class _Machine(_Strict):
    """The parts that the machine has, of those that only some have: the effects of all others are no candidates."""

    has: list[str]


class PriorEntry(_Strict):
    """Odds of an effect, p / (1 - p), and the 95 % range of each of its parameters by name."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Interval]

    odds: float | None = None  # None: as of any other effect


class PreparedRecording(_Strict):
    """A recording that was used."""

    name: str  # of the recording
    sha256: str  # of its file
    samples_used: int  # how many of its samples counted
    # by effect, when it begins and ends, since the recording began [s]
    events: dict[str, Annotated[list[float], Field(min_length=2, max_length=2)]] = {}


class Prepared(_Strict):
    """What ``hil diagnose`` did to recordings before it fitted: ``hil simulate`` and ``hil compare`` do it again."""

    mended: bool = True  # whether wraps, and what no sensor has read, were taken out (`with_motion_corrected`)
    one_in: int = Field(default=1, ge=1)  # to one in how many samples recordings are thinned
    recordings: list[PreparedRecording] = []  # that the diagnosis was made of


class ModelDocument(_Strict):
    """The file's tables, before the model is made of them."""

    schema_: Literal["hil.model/1"] = Field(alias="schema")
    structure: Annotated[Structure, Field(strict=False)]  # one, two or three masses, or a joint
    motion: Annotated[Motion, Field(strict=False)] = Motion.ROTATION  # by which all values have their units
    parameters: dict[str, ParameterEntry]  # by name, all those of the structure
    geometry: _Geometry | None = None  # the gear ratio
    load: _Load | None = None  # whose the constant load torque is, or what it is
    machine: _Machine | None = None  # parts that it has; None: nobody says
    priors: dict[str, PriorEntry] = {}  # by name of the effect
    effects: dict[str, dict[str, _EffectEntry]] = {}  # by name, then by parameter
    tables: dict[str, TableEntry] = {}  # laws without a name, by place
    laws: dict[str, LawTable] = {}  # a user's own, by name
    signals: SignalsConfig | None = None  # how its recordings are read; None: by this program's own columns
    prepared: Prepared | None = None  # what a diagnosis did to recordings; None in a file by hand


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
        parameters[name] = _inline(trusted_entry(model.parameters[name])).comment(parameter_unit(name, model.motion))
    document["parameters"] = parameters
    if model.gear_ratio is not None:
        document["geometry"] = {"gear_ratio": float(model.gear_ratio)}
    if model.load is not Load.OWN:
        constant = model.load.value if isinstance(model.load, Load) else float(model.load)
        document["load"] = {"constant": constant}
    if model.has is not None:
        document["machine"] = {"has": sorted(model.has)}
    if model.priors:
        document["priors"] = _priors_table(model)
    _add_effects(document, model)
    if laws:
        document["laws"] = _laws_table(laws)
    if signals is not None:
        document["signals"] = _signals_table(signals)
    if prepared is not None:
        document["prepared"] = _prepared_table(prepared)
    return f"{schema_line(FileKind.MODEL)}\n{tomlkit.dumps(document)}"


def _add_effects(document: tomlkit.TOMLDocument, model: DrivelineModel) -> None:
    """Add what the model has beyond the line: effects of the catalogue, and laws without a name as tables."""
    if {*model.effects} - {*TABLES}:
        document["effects"] = _effects_table(model)
    if {*model.effects} & {*TABLES}:
        document["tables"] = _law_tables(model)


def trusted_entry(parameter: Parameter) -> dict[str, Any]:
    """Return a nominal parameter as its table: the value, and what it is trusted to."""
    value = float(parameter.value)
    if parameter.ci95 is None:
        return {"value": value, "tolerance": float(parameter.tolerance)}
    return {"value": value, "ci95": [float(end) for end in parameter.ci95]}


def _priors_table(model: DrivelineModel) -> Table:
    table = tomlkit.table()
    for name, prior in model.priors.items():
        odds = {} if prior.odds is None else {"odds": float(prior.odds)}
        table[name] = _inline({**odds, **{key: [float(end) for end in ends] for key, ends in prior.sizes.items()}})
    return table


def _effects_table(model: DrivelineModel) -> Table:
    effects = tomlkit.table(is_super_table=True)
    for name, values in model.effects.items():
        if name in TABLES:
            continue
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


def _law_tables(model: DrivelineModel) -> Table:
    tables = tomlkit.table(is_super_table=True)
    for name, values in model.effects.items():
        if name not in TABLES:
            continue
        law = table_of(name, values)
        at, table = PLACES[law.place], tomlkit.table()
        table.comment(f"a law without a name, next to what the line has there: {at.sign}, over {at.over}")
        table["knots"] = _row(law.knots).comment(unit(at.dimension, model.motion))
        table["values"] = _row(law.values).comment(unit("torque", model.motion))
        if law.ci95 is not None and all(math.isfinite(bound) for band in law.ci95 for bound in band):
            table["ci95"] = _row(law.ci95)
        if law.damping:
            table["damping"] = tomlkit.item(float(law.damping)).comment(unit("damping", model.motion))
        tables[law.place] = table
    return tables


def _row(values: Sequence[Any]) -> Array:
    row = tomlkit.array()
    row.extend([[*each] if isinstance(each, tuple) else float(each) for each in values])
    return row


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
