"""The state file of a commissioning: ``commission.json`` (schema ``hil.commission/1``), whole after every change.

It is written next to itself and moved over the old one, so that neither an interruption nor a full disk nor the end of
power leaves half of it.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from hil import __version__
from hil.commission.record import Status, StepRecord, now_utc
from hil.commission.state_model import StateFile
from hil.errors import UsageError
from hil.inside import is_inside
from hil.parse_json import read_json
from hil.problems import problem_lines

SCHEMA: Final = "hil.commission/1"
FILE_NAME: Final = "commission.json"

MOST_NAMED: Final = 3
"""Keys at fault that a message names."""


@dataclass(slots=True)
class State:
    """A commissioning as far as it is.

    Attributes
    ----------
    folder
        Where the file and everything next to it is.
    rig_name, rig_path, rig_text
        The rig file as of the last call.
    steps
        Record of every step, by name, in order.
    notes
        What was decided about the whole, such as keeping results after the rig file was changed.
    made
        What the report was made from (``hil.provenance``); None before there is one.
    """

    folder: Path
    rig_name: str
    rig_path: str
    rig_text: str
    steps: dict[str, StepRecord]
    started_utc: str = field(default_factory=now_utc)
    notes: list[dict[str, str]] = field(default_factory=list)
    made: dict[str, Any] | None = None

    @property
    def path(self) -> Path:
        """The state file."""
        return self.folder / FILE_NAME

    def document(self) -> dict[str, Any]:
        """Return the content of the file."""
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
        _require_state(folder, document)
    except (ValueError, OSError) as error:
        raise UsageError(
            f"{path}: expected the state of a commissioning ({SCHEMA}), got a file that can't be read as one: "
            f"{error}. Move it away to begin anew in this folder (its recordings stay), or choose another by --out."
        ) from error
    known = {key: document[key] for key in ("rig_name", "rig_path", "rig_text", "started_utc", "notes")}
    steps = {name: _step(document["steps"].get(name)) for name in names}
    return State(folder=folder, steps=steps, made=document.get("made"), **known)


def _require_state(folder: Path, document: Any) -> None:
    """Refuse what is no state, or names a recording elsewhere."""
    if not isinstance(document, dict):
        raise ValueError(f"expected a table, got {type(document).__name__}")
    try:
        file = StateFile.model_validate(document)
    except ValidationError as cause:
        lines = problem_lines(StateFile, cause)
        more = f"; and {len(lines) - MOST_NAMED} more" if len(lines) > MOST_NAMED else ""
        raise ValueError("; ".join(lines[:MOST_NAMED]) + more) from cause
    for run in file.steps.runs():
        if run.recording is not None and not is_inside(folder, folder / run.recording):
            raise ValueError(f"run {run.name}: a recording outside {folder}: {run.recording}")


def _step(document: Any) -> StepRecord:
    if document is None:
        return StepRecord()
    record = StepRecord.from_json(document)
    if record.status is Status.RUNNING:  # the program was killed, or its machine went down
        record.end(Status.INTERRUPTED, "the program ended without a word: it was killed, or the machine went down")
    return record
