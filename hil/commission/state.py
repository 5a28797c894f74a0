"""What is kept of a commissioning: its steps, their findings, evidence and runs, in commission.json."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields
from datetime import UTC, datetime
from enum import Enum
from pathlib import Path
from typing import Any, Final

from estimator.physics.model import DrivelineModel, Parameter, Structure
from hil import __version__
from hil.errors import UsageError
from hil.inside import is_inside
from hil.parse_json import read_json


@dataclass(frozen=True, slots=True)
class Finding:
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

    def as_json(self) -> dict[str, Any]:
        return asdict(self)


def stated(what: str, measured: str) -> Finding:
    """State a value that has no limit."""
    return Finding(what, "–", measured, None)


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


@dataclass(slots=True)
class RunRecord:
    """One run of a step: its recording next to the state file, and what was predicted and measured [Nm, rad/s].

    ``whole`` is False where the run was ended early; its recording then holds what there was.
    """

    name: str
    recording: str | None
    whole: bool
    seconds: float
    predicted: dict[str, list[float]]
    measured: dict[str, list[float]]
    flagged: int = 0
    recorded: int = 0
    prbs_nm: float = 0.0
    last_rad_s: float = 0.0


@dataclass(slots=True)
class StepRecord:
    """One step; see the module's text."""

    status: Status = Status.PENDING
    because: str = ""
    attempt: int = 0
    rig_digest: str = ""
    started_utc: str = ""
    ended_utc: str = ""
    findings: list[Finding] = field(default_factory=list)
    evidence: dict[str, Any] = field(default_factory=dict)
    runs: list[RunRecord] = field(default_factory=list)
    history: list[dict[str, Any]] = field(default_factory=list)

    def begin(self, rig_digest: str, keep_runs: bool) -> None:
        """Begin an attempt; the one before it goes to the history, its whole runs stay where ``keep_runs``."""
        if self.attempt:
            self.history.append(
                {
                    "attempt": self.attempt,
                    "status": self.status.value,
                    "because": self.because,
                    "ended_utc": self.ended_utc,
                    "recordings": [run.recording for run in self.runs if run.recording],
                    "findings": [finding.as_json() for finding in self.findings],
                }
            )
        self.attempt += 1
        self.runs = [run for run in self.runs if run.whole] if keep_runs else []
        self.status, self.because, self.rig_digest = Status.RUNNING, "", rig_digest
        self.findings, self.evidence = [], {}
        self.started_utc, self.ended_utc = now_utc(), ""

    def end(self, status: Status, because: str = "") -> None:
        self.status, self.because, self.ended_utc = status, because, now_utc()

    def run(self, name: str) -> RunRecord | None:
        """Return the whole run of a name, if there is one."""
        return next((run for run in self.runs if run.name == name and run.whole), None)

    def as_json(self) -> dict[str, Any]:
        document = {each.name: getattr(self, each.name) for each in fields(self)}
        return document | {
            "status": self.status.value,
            "findings": [finding.as_json() for finding in self.findings],
            "runs": [asdict(run) for run in self.runs],
        }

    @classmethod
    def from_json(cls, document: dict[str, Any]) -> StepRecord:
        """Read it from the state file."""
        known = {each.name: document[each.name] for each in fields(cls)}
        return cls(
            **known
            | {
                "status": Status(known["status"]),
                "findings": [Finding(**finding) for finding in known["findings"]],
                "runs": [RunRecord(**run) for run in known["runs"]],
            }
        )


def now_utc() -> str:
    """Return the present time as text."""
    return datetime.now(UTC).isoformat(timespec="seconds")


SCHEMA: Final = "hil.commission/1"
FILE_NAME: Final = "commission.json"


@dataclass(slots=True)
class State:
    """A commissioning as far as it is."""

    folder: Path  # Where the file and everything next to it is
    rig_name: str  # The rig file as of the last call
    rig_path: str  # The rig file as of the last call
    rig_text: str  # The rig file as of the last call
    steps: dict[str, StepRecord]  # Record of every step, by name, in order
    started_utc: str = field(default_factory=now_utc)
    notes: list[dict[str, str]] = field(default_factory=list)
    made: dict[str, Any] | None = None  # What the report was made from (``hil.provenance``); None before there is one

    @property
    def path(self) -> Path:
        return self.folder / FILE_NAME

    def document(self) -> dict[str, Any]:
        return {
            "schema": SCHEMA,
            "hil_version": __version__,
            "rig_name": self.rig_name,
            "rig_path": self.rig_path,
            "rig_text": self.rig_text,
            "started_utc": self.started_utc,
            "updated_utc": now_utc(),
            "notes": self.notes,
            "made": self.made,
            "steps": {name: record.as_json() for name, record in self.steps.items()},
        }

    def save(self) -> None:
        """Write the file, whole or not at all."""
        text = json.dumps(self.document(), indent=1, ensure_ascii=False, allow_nan=False) + "\n"
        part = self.path.with_name(f".{FILE_NAME}.{os.getpid()}.part")
        try:
            with part.open("w", encoding="utf-8") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            part.replace(self.path)
        except OSError as error:
            raise UsageError(
                f"{self.path}: expected room for the state, got: {error.strerror or error}. The one before it is "
                "kept; make room and call again."
            ) from error
        finally:
            part.unlink(missing_ok=True)

    @property
    def outside(self) -> int:
        """How many findings are outside their limits."""
        return sum(finding.within is False for record in self.steps.values() for finding in record.findings)

    @property
    def is_complete(self) -> bool:
        """Whether every step is done, or was skipped for a reason."""
        return all(record.status.is_settled for record in self.steps.values())


def load_state(folder: Path, names: Iterable[str]) -> State | None:
    """Read the state of a folder; None where there is none. A step that is new to it is pending."""
    path = folder / FILE_NAME
    if not path.exists():
        return None
    try:
        document = read_json(path)
        if document["schema"] != SCHEMA:
            raise ValueError(f"schema {document['schema']!r}")
        steps = {name: _step(folder, document["steps"].get(name)) for name in names}
        return State(
            folder=folder,
            rig_name=document["rig_name"],
            rig_path=document["rig_path"],
            rig_text=document["rig_text"],
            steps=steps,
            started_utc=document["started_utc"],
            notes=document["notes"],
            made=document.get("made"),
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise UsageError(
            f"{path}: expected the state of a commissioning ({SCHEMA}), got a file that can't be read as one: "
            f"{error}. Move it away to begin anew in this folder (its recordings stay), or choose another by --out."
        ) from error


def _step(folder: Path, document: Any) -> StepRecord:
    if document is None:
        return StepRecord()
    record = StepRecord.from_json(document)
    for run in record.runs:
        if run.recording is not None and not is_inside(folder, folder / run.recording):
            raise ValueError(f"run {run.name}: a recording outside {folder}: {run.recording}")
    if record.status is Status.RUNNING:  # the program was killed, or its machine went down
        record.end(Status.INTERRUPTED, "the program ended without a word: it was killed, or the machine went down")
    return record


def model_json(model: DrivelineModel) -> dict[str, Any]:
    """Return structure and parameters; effects are left to model files."""
    return {
        "structure": model.structure.value,
        "parameters": {name: [each.value, each.tolerance] for name, each in model.parameters.items()},
    }


def model_from_json(document: Mapping[str, Any]) -> DrivelineModel:
    parameters = {name: Parameter(value, tolerance) for name, (value, tolerance) in document["parameters"].items()}
    return DrivelineModel(Structure(document["structure"]), parameters)
