"""What is kept of one step: how it ended, with what findings, on which evidence, and how earlier attempts ended."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields
from datetime import UTC, datetime
from enum import Enum
from typing import Any

from hil.commission.finding import Finding


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
        """End the attempt."""
        self.status, self.because, self.ended_utc = status, because, now_utc()

    def run(self, name: str) -> RunRecord | None:
        """Return the whole run of a name, if there is one."""
        return next((run for run in self.runs if run.name == name and run.whole), None)

    def as_json(self) -> dict[str, Any]:
        """Return it for the state file."""
        document = {each.name: getattr(self, each.name) for each in fields(self)}
        return document | {
            "status": self.status.value,
            "findings": [finding.as_json() for finding in self.findings],
            "runs": [asdict(run) for run in self.runs],
        }

    @classmethod
    def from_json(cls, document: dict[str, Any]) -> StepRecord:
        """Read it from the state file, which is one (`hil.commission.state_model`); keys of later versions are left."""
        known = _fields_of(cls, document)
        findings = [Finding(**_fields_of(Finding, finding)) for finding in known["findings"]]
        runs = [RunRecord(**_fields_of(RunRecord, run)) for run in known["runs"]]
        return cls(**known | {"status": Status(known["status"]), "findings": findings, "runs": runs})


def _fields_of(kind: type[StepRecord | RunRecord | Finding], document: dict[str, Any]) -> dict[str, Any]:
    return {each.name: document[each.name] for each in fields(kind) if each.name in document}


def now_utc() -> str:
    """Return the present time as text."""
    return datetime.now(UTC).isoformat(timespec="seconds")
