"""Evidence of the steps of a commissioning, as its state file has it: one table per step, by pydantic.

A state file may be a stranger's. What it has is compared with these before a step or a page reads it; a quantity that
could not be determined is null there.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from types import MappingProxyType
from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, FiniteFloat, TypeAdapter, model_validator

from estimator.errors import EstimatorError
from estimator.physics.model import DrivelineModel, Parameter, Structure
from hil.config.model_tables import ParameterEntry
from hil.design.solve_state import STATE
from hil.orders.runner import Both, Number

Known = Number | None
Interval = Annotated[list[Known], Field(min_length=2, max_length=2)]
"""A value and half of its 95 % interval."""

Whole = tuple[Number, Known]
"""A value that is there, and half of its interval."""

Positive = Annotated[FiniteFloat, Field(gt=0, le=1e30)]
Name = Annotated[str, Field(max_length=200)]
Part = Annotated[FiniteFloat, Field(ge=-1e9, le=1e9)]
Roots = list[tuple[Part, Part]]


def _moment(text: str) -> str:
    """Accept a moment in ISO 8601, or nothing."""
    if text:
        datetime.fromisoformat(text)
    return text


def _below(text: str) -> str:
    """Accept the path of a file below the folder of the commissioning."""
    if not text or text.startswith(("/", "\\")) or ":" in text or ".." in text:
        raise ValueError("expected a path below the folder")
    return text


Utc = Annotated[str, AfterValidator(_moment)]
PathBelow = Annotated[str, AfterValidator(_below)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="ignore")


class _Course(_Table):
    """Columns of one length, time first."""

    time_s: list[Known]

    @model_validator(mode="after")
    def _of_one_length(self) -> _Course:
        if any(len(column) != len(self.time_s) for _, column in self):
            raise ValueError("expected columns of one length")
        return self


class _SpeedCourse(_Course):
    speed_rad_s: list[Known]


class _PulseCourse(_SpeedCourse):
    reference_nm: list[Known]
    reading_nm: list[Known]


class _DrivenCourse(_SpeedCourse):
    torque_nm: list[Known]


class _Worst(_Course):
    name: Name
    simulated_rad_s: list[Known]
    measured_rad_s: list[Known]

    @model_validator(mode="after")
    def _of_one_length(self) -> _Worst:
        if not len(self.time_s) == len(self.simulated_rad_s) == len(self.measured_rad_s):
            raise ValueError("expected columns of one length")
        return self


class ModelEvidence(_Table):
    """A driveline: structure, and each parameter as in a model file, or as value and tolerance alone."""

    structure: Structure  # one, two or three masses
    parameters: dict[str, Both | ParameterEntry]  # by name; [value, tolerance], or as in a model file

    @model_validator(mode="after")
    def _is_a_driveline(self) -> ModelEvidence:
        try:
            self.model()
        except (EstimatorError, KeyError) as error:
            raise ValueError(f"expected a driveline: {error}") from error
        return self

    def model(self) -> DrivelineModel:
        """Return the driveline; `EstimatorError` or KeyError where it is none."""
        return DrivelineModel(
            self.structure,
            {
                name: Parameter(each[0], each[1]) if isinstance(each, list) else each.parameter()
                for name, each in self.parameters.items()
            },
        )


class _Noise(_Table):
    speed_std_rad_s: Known
    speed_mean_rad_s: Known
    course: _SpeedCourse


class _Pulses(_Table):
    step_nm: Number
    speed: Interval
    reading: Interval
    course: _PulseCourse


class _Signs(_Table):
    m1: _Pulses | None = None
    m2: _Pulses | None = None


class _Scales(_Table):
    gain: Interval
    delay_s: Interval
    extra_samples: Annotated[int, Field(ge=0, le=1000)]
    amplitude_nm: Positive
    duration_s: Positive
    resonance: Both | None = None
    spread: Interval | None = None
    model: ModelEvidence | None = None


class _Friction(_Table):
    inertia_kg_m2: Whole
    dry_nm: Interval
    viscous_nm_s: Interval
    load_nm: Interval
    rms_rad_s: Known
    course: _DrivenCourse


class _Prbs(_Table):
    amplitude_nm: Positive
    reason: str
    tries: list[dict[str, Any]]


class _Linear(_Table):
    theta: list[Known]
    nk: int
    sample_time_s: Positive
    poles: Roots
    zeros: Roots
    resonance: Both | None


class _Spectral(_Table):
    frequency_hz: list[Known]
    magnitude: list[Known]
    coherence: list[Known]


class _Identified(_Table):
    run: Name
    best: _Linear
    batch: _Linear
    online: _Linear
    frequency_hz: list[Known]
    magnitude: list[Known]
    spectral: _Spectral | None

    @model_validator(mode="after")
    def _of_like_periods(self) -> _Identified:
        periods_s = [each.sample_time_s for each in (self.best, self.batch, self.online)]
        if max(periods_s) > 32.0 * min(periods_s):  # a pole is brought from one to the other by a power
            raise ValueError("expected sample times of one recording")
        return self


class _Identification(_Table):
    runs: Annotated[list[_Identified], Field(min_length=1)]


class _Validation(_Table):
    model: ModelEvidence
    parameters: dict[str, Interval]
    rms_rad_s: Known
    unseen: dict[str, dict[str, Known]]
    worst: _Worst


class _Value(_Table):
    nominal: Known
    value: Known
    ci95: Interval
    unit: Name


class _Diagnosis(_Table):
    verdict: Literal["explained", "partly_explained", "unexplained", "no_mismatch"]
    headline: str
    statement: str
    effects: list[Name]
    alike: list[Name] = Field(default_factory=list)
    report: PathBelow
    model_file: PathBelow
    seconds: Known
    parameters: dict[str, _Value]


EVIDENCE: Final[Mapping[str, TypeAdapter[Any]]] = MappingProxyType(
    {
        "noise": TypeAdapter(_Noise),
        "signs": TypeAdapter(_Signs),
        "scales": TypeAdapter(_Scales),
        "friction": TypeAdapter(_Friction),
        "prbs": TypeAdapter(_Prbs),
        "identification": TypeAdapter(_Identification),
        "validation": TypeAdapter(_Validation),
        "diagnosis": TypeAdapter(_Diagnosis),
        "solve": STATE,
    }
)
"""What each step's evidence is; steps that leave none are not listed."""
