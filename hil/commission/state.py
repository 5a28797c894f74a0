"""What a commissioning keeps in its folder, in commission.json: steps, findings, evidence, runs; one call at a time."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import Field, TypeAdapter, ValidationError

from estimator.physics.model import DrivelineModel
from hil.commission.evidence import EVIDENCE, ModelEvidence, Utc
from hil.config.model_tables import trusted_entry
from hil.errors import UsageError
from hil.files import is_inside, read_json, write_whole
from hil.orders.runner import RunRecord, now_utc
from hil.version import __version__

SCHEMA: Final = "hil.commission/1"
FILE_NAME: Final = "commission.json"


@dataclass(frozen=True, slots=True)
class StepFinding:
    """One line of a step's verdict."""

    what: str  # The quantity, in a few words
    expected: str  # The limit, with its unit
    measured: str  # The value, with its unit and interval
    within: bool | None  # Whether it is; None where the data don't tell, or there is no limit to keep
    advice: str = ""  # What to do where it is not within; empty where nothing need be done
    blocking: bool = False  # Whether continuing would be unsafe, or without meaning

    @property
    def stops(self) -> bool:
        """Whether the commissioning ends here."""
        return self.blocking and self.within is not True


def stated(what: str, measured: str) -> StepFinding:
    """State a value that has no limit."""
    return StepFinding(what, "–", measured, None)


class Status(Enum):
    """How far a step is."""

    PENDING = "pending"
    RUNNING = "running"
    DONE = "done"
    BLOCKED = "blocked"
    SKIPPED = "skipped"
    INTERRUPTED = "interrupted"

    @property
    def is_settled(self) -> bool:
        """Whether the next call goes past it."""
        return self in (Status.DONE, Status.SKIPPED)


@dataclass(frozen=True, slots=True)
class Attempt:
    """An attempt before the last one."""

    attempt: int  # its number, from 1
    status: Status  # how it ended
    because: str  # why, where it did not come to its end; else empty
    ended_utc: Utc  # ISO 8601
    recordings: list[str]  # relative to the folder, those of runs that were ended early too
    findings: list[StepFinding]  # in their order


@dataclass(slots=True)
class StepRecord:
    """One step: the last attempt, and those before it."""

    status: Status = Status.PENDING  # of the last attempt
    because: str = ""  # why it was skipped, blocked, interrupted or set back; else empty
    attempt: int = 0  # number of the last one, from 1; 0 before the first
    rig_digest: str = ""  # `rig_digest` of the rig file that its results are of, or were kept for; empty before any
    started_utc: Utc = ""  # ISO 8601; empty before the first attempt
    ended_utc: Utc = ""  # ISO 8601; empty while it is under way
    findings: list[StepFinding] = field(default_factory=list)  # of the last attempt, in their order
    # what other steps and the report need of it, as `EVIDENCE` has it for the step
    evidence: dict[str, Any] = field(default_factory=dict)
    runs: list[RunRecord] = field(default_factory=list)  # of the last attempt, those that were ended early too
    history: list[Attempt] = field(default_factory=list)  # attempts before the last, oldest first

    def begin(self, rig_digest: str, keep_runs: bool) -> None:
        """Begin an attempt; the one before it goes to the history, by ``keep_runs`` whole runs and evidence stay."""
        if self.attempt:
            recordings = [run.recording for run in self.runs if run.recording]
            self.history.append(
                Attempt(self.attempt, self.status, self.because, self.ended_utc, recordings, self.findings)
            )
        self.attempt += 1
        self.runs = [run for run in self.runs if run.whole] if keep_runs else []
        self.status, self.because, self.rig_digest = Status.RUNNING, "", rig_digest
        self.findings, self.evidence = [], self.evidence if keep_runs else {}
        self.started_utc, self.ended_utc = now_utc(), ""

    def end(self, status: Status, because: str = "") -> None:
        """End the attempt now; ``because`` says why, where it did not come to its end."""
        self.status, self.because, self.ended_utc = status, because, now_utc()

    def run(self, name: str) -> RunRecord | None:
        """Return the whole run of a name, if there is one."""
        return next((run for run in self.runs if run.name == name and run.whole), None)


@dataclass(frozen=True, slots=True)
class Note:
    """What was decided about the whole, such as keeping results after the rig file was changed."""

    at_utc: Annotated[Utc, Field(min_length=1)]  # ISO 8601
    what: str  # what it was about
    changes: str  # keys of the rig file with their old and new values; empty where none differs
    steps: str  # what was decided of the steps done before: repeated, or kept and why


@dataclass(slots=True)
class CommissioningState:
    """A commissioning as far as it is."""

    folder: Path  # Where the file and everything next to it is
    rig_name: str  # name in the rig file of the last call
    rig_path: str  # path of that file, as it was given
    rig_text: str  # its text
    steps: dict[str, StepRecord]  # Record of every step, by name, in order
    started_utc: Annotated[Utc, Field(min_length=1)] = field(default_factory=now_utc)  # of the first call, ISO 8601
    notes: list[Note] = field(default_factory=list)  # oldest first
    made: dict[str, Any] | None = None  # What the report was made from (``hil.provenance``); None before there is one
    schema: Literal["hil.commission/1"] = SCHEMA  # of the file

    @property
    def path(self) -> Path:
        """The state file."""
        return self.folder / FILE_NAME

    def document(self) -> dict[str, Any]:
        """Return what the state file holds, with the version of the program and the present time."""
        kept: dict[str, Any] = _STATE.dump_python(self, mode="json", exclude={"folder"})
        return {**kept, "hil_version": __version__, "updated_utc": now_utc()}

    def save(self) -> None:
        """Write the file, whole or not at all."""
        text = json.dumps(self.document(), indent=1, ensure_ascii=False, allow_nan=False) + "\n"
        try:
            write_whole(self.path, text)
        except OSError as error:
            raise UsageError(
                f"{self.path}: expected room for the state, got: {error.strerror or error}. The one before it is "
                "kept; make room and call again."
            ) from error


_STATE: Final = TypeAdapter(CommissioningState)


def load_state(folder: Path, names: Iterable[str]) -> CommissioningState | None:
    """Read the state of a folder; None where there is none. A step that is new to it is pending."""
    path = folder / FILE_NAME
    if not path.exists():
        return None
    try:
        content = read_json(path)
        state = _STATE.validate_python({**content, "folder": folder} if isinstance(content, dict) else content)
        state.steps = {name: _checked(folder, name, state.steps.get(name, StepRecord())) for name in names}
    except (OSError, ValueError) as error:
        raise UsageError(
            f"{path}: expected the state of a commissioning ({SCHEMA}), got a file that can't be read as one: "
            f"{_first(error)}. Move it away to begin anew in this folder (its recordings stay), or choose another by "
            "--out."
        ) from error
    return state


def _checked(folder: Path, name: str, record: StepRecord) -> StepRecord:
    for run in record.runs:
        if run.recording is not None and not is_inside(folder, folder / run.recording):
            raise ValueError(f"run {run.name}: a recording outside {folder}: {run.recording}")
    if record.evidence and name in EVIDENCE:
        EVIDENCE[name].validate_python(record.evidence)
    if record.status is Status.RUNNING:  # the program was killed, or its machine went down
        record.end(Status.INTERRUPTED, "the program ended without a word: it was killed, or the machine went down")
    return record


def _first(error: OSError | ValueError) -> str:
    """Say the first thing that is wrong, and where."""
    if not isinstance(error, ValidationError):
        return str(error)
    first = error.errors()[0]
    place = ".".join(str(part) for part in first["loc"])
    return f"{place}: {first['msg']}" if place else first["msg"]


def model_json(model: DrivelineModel) -> dict[str, Any]:
    """Return structure and parameters; effects are left to model files."""
    return {
        "structure": model.structure.value,
        "parameters": {name: trusted_entry(each) for name, each in model.parameters.items()},
    }


def model_from_json(document: Mapping[str, Any]) -> DrivelineModel:
    """Return the model again."""
    return ModelEvidence.model_validate(document).model()
