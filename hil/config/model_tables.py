"""The tables of a model file, ``hil.model/1``, as they are written, before a model is made of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from estimator.physics.model import Motion, Structure
from hil.config.laws import LawTable
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
