"""What ``commission.json`` may hold: the model that it is read through, before anything is drawn or driven from it.

Evidence may have more keys than stand here: these are what a later step or the report reads.
"""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Annotated, Any, Generic, Literal, Self, TypeVar

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from estimator.errors import BadModel
from estimator.physics.model import DrivelineModel, Parameter, Structure
from hil.problems import Fault, refuse

LARGEST = 1e15
"""No value of a driveline is beyond it, and products of several such stay finite."""


def _moment(text: str) -> str:
    if text:
        try:
            datetime.fromisoformat(text).astimezone(UTC)
        except OverflowError as error:
            raise ValueError(str(error)) from error
    return text


Moment = Annotated[str, AfterValidator(_moment)]
"""ISO 8601, or empty."""
Number = Annotated[float, Field(allow_inf_nan=False, ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, Field(allow_inf_nan=False, ge=1e-9, le=1e9)]
Count = Annotated[int, Field(ge=0, le=10**12)]
Two = Field(min_length=2, max_length=2)
Numbers = Annotated[list[Number], Two]
Estimate = Annotated[list[Number | None], Two]
"""A value and half its 95 % interval, null where not known."""
Series = list[Number | None]


class Part(BaseModel):
    """A part of the file."""

    model_config = ConfigDict(strict=True, frozen=True, extra="ignore")


class FindingPart(Part):
    """As `hil.commission.finding.Finding`."""

    what: str
    expected: str
    measured: str
    within: bool | None
    advice: str = ""
    blocking: bool = False


class RunPart(Part):
    """As `hil.commission.record.RunRecord`."""

    name: str
    recording: str | None
    whole: bool
    seconds: Annotated[Number, Field(ge=0.0)]
    predicted: dict[str, Numbers]
    measured: dict[str, Numbers]
    flagged: Count = 0
    recorded: Count = 0
    prbs_nm: Number = 0.0
    last_rad_s: Number = 0.0


class AttemptPart(Part):
    """An earlier attempt of a step."""

    attempt: Count
    status: Literal["pending", "running", "done", "blocked", "skipped", "interrupted"]
    because: str
    ended_utc: Moment
    recordings: list[str]
    findings: list[FindingPart]


class Alike(Part):
    """Lists of numbers that belong together, all of one length."""

    @model_validator(mode="after")
    def _are_alike(self) -> Self:
        lists = {name: value for name, value in self if isinstance(value, list)}
        (first, values), *others = lists.items()
        count = len(values)
        refuse(
            Fault(name, f"{count} values, as many as in {first}", len(each))
            for name, each in others
            if len(each) != count
        )
        return self


class Course(Alike):
    """Series over time."""

    time_s: Annotated[list[Number], Field(min_length=1)]

    @model_validator(mode="after")
    def _runs_forward(self) -> Self:
        if any(later < earlier for earlier, later in zip(self.time_s, self.time_s[1:], strict=False)):
            refuse([Fault("time_s", "moments that increase", "one before the last")])
        return self


class SpeedCourse(Course):
    """Speed over time."""

    speed_rad_s: Series


class PulseCourse(SpeedCourse):
    """The answer to pulses of torque."""

    reference_nm: Series
    reading_nm: Series


class ReversalCourse(SpeedCourse):
    """The torque of both and the speed."""

    torque_nm: Series


class WorstCourse(Course):
    """The unseen run with the largest error."""

    name: str
    simulated_rad_s: Series
    measured_rad_s: Series


class ModelPart(Part):
    """As `hil.commission.model_json` writes a model."""

    structure: Literal["one_mass", "two_mass", "three_mass", "joint"]
    parameters: dict[str, Numbers]

    @model_validator(mode="after")
    def _is_a_model(self) -> Self:
        try:
            DrivelineModel(
                Structure(self.structure), {name: Parameter(*each) for name, each in self.parameters.items()}
            )
        except BadModel as error:
            refuse([Fault("parameters", "those of a driveline model", str(error))])
        return self


class Noise(Part):
    """Of the step noise."""

    speed_std_rad_s: Number | None = None
    course: SpeedCourse


class Pulses(Part):
    """Of one inverter, in the step signs."""

    course: PulseCourse


class Signs(Part):
    """Of the step signs."""

    m1: Pulses | None = None
    m2: Pulses | None = None


class Scales(Part):
    """Of the step scales."""

    gain: Estimate
    extra_samples: Count | None
    amplitude_nm: Positive
    duration_s: Positive
    resonance: Numbers | None = None
    spread: Numbers | None = None
    model: ModelPart | None = None

    @model_validator(mode="after")
    def _has_both(self) -> Self:
        if (self.resonance is None) != (self.spread is None):
            refuse([Fault("resonance", "resonance and spread, or neither", "one of them")])
        return self


class Friction(Part):
    """Of the step friction."""

    inertia_kg_m2: Estimate
    course: ReversalCourse


class Prbs(Part):
    """Of the step prbs."""

    amplitude_nm: Positive
    reason: str


class LinearPart(Part):
    """An identified model."""

    sample_time_s: Positive
    poles: list[Numbers]
    zeros: list[Numbers]
    resonance: Numbers | None


class SpectralPart(Alike):
    """A spectral estimate."""

    frequency_hz: Series
    magnitude: Series
    coherence: Series


class IdentifiedRun(Alike):
    """A run that was identified."""

    frequency_hz: Series
    magnitude: Series
    run: str
    best: LinearPart
    online: LinearPart
    spectral: SpectralPart | None


class Identification(Part):
    """Of the step identification."""

    runs: list[IdentifiedRun]


class Validation(Part):
    """Of the step validation."""

    model: ModelPart
    worst: WorstCourse


class DiagnosisPart(Part):
    """Of the step diagnosis."""

    statement: str
    report: str
    model_file: str


class Anything(Part):
    """Evidence that nobody reads again."""


Evidence = TypeVar("Evidence", bound=Part)


def _or_none(evidence: Any) -> Any:
    return None if evidence == {} else evidence


class StepPart(Part, Generic[Evidence]):
    """As `hil.commission.record.StepRecord`; evidence that is empty is none."""

    status: Literal["pending", "running", "done", "blocked", "skipped", "interrupted"]
    because: str
    attempt: Count
    rig_digest: str
    started_utc: Moment
    ended_utc: Moment
    findings: list[FindingPart]
    evidence: Annotated[Evidence | None, BeforeValidator(_or_none)]
    runs: list[RunPart]
    history: list[AttemptPart]


class StepsPart(Part):
    """The steps; one that is not there was not begun."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, StepPart[Anything] | None]

    devices: StepPart[Anything] | None = None
    limits: StepPart[Anything] | None = None
    noise: StepPart[Noise] | None = None
    signs: StepPart[Signs] | None = None
    scales: StepPart[Scales] | None = None
    friction: StepPart[Friction] | None = None
    prbs: StepPart[Prbs] | None = None
    experiments: StepPart[Anything] | None = None
    identification: StepPart[Identification] | None = None
    validation: StepPart[Validation] | None = None
    diagnosis: StepPart[DiagnosisPart] | None = None

    def runs(self) -> Iterator[RunPart]:
        """Return the runs of all steps."""
        for _, step in self:  # those of other names, too
            if step is not None:
                yield from step.runs


class NotePart(Part):
    """What was decided about the whole."""

    at_utc: Moment
    what: str
    changes: str
    steps: str


class StateFile(Part):
    """The file."""

    schema_name: Literal["hil.commission/1"] = Field(alias="schema")
    rig_name: str
    rig_path: str
    rig_text: str
    started_utc: Annotated[Moment, Field(min_length=1)]
    notes: list[NotePart]
    made: dict[str, Any] | None = None
    steps: StepsPart
