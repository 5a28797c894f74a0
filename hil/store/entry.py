"""What the store keeps of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hil.parse_json import parse_json
from hil.recording.checksum import text_sha256

COMPLETE = "complete"
"""Outcome of a run that reached its end; any other is what ended it."""

DIAGNOSIS, IDENTIFICATION, ONLINE, MODEL = "diagnosis", "identification", "online", "model"
"""Kinds of attachment that mean something here; others are kept all the same."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunEntry:
    """One run as it is entered.

    Attributes
    ----------
    recording : Path
        The recording, inside the store's folder.
    data_sha256 : str
        Checksum of its cells (`hil.recording.checksum`); empty where it carries none.
    experiment : str
        Name of the experiment.
    started_utc : str
        ISO 8601 with offset; empty where it is not known.
    duration_s : float
        Time from the first row to the last, and one period more [s].
    samples, flagged : int
        Rows, and how many of them are flagged.
    software_version : str
        Of the program that recorded.
    rig_name, rig_text : str
        Name and whole text of the rig file; empty where the recording does not carry it.
    eds_sha256 : mapping of inverter to str
        SHA-256 of each EDS the scales were from.
    outcome : str
        `COMPLETE`, or what ended the run.
    settings : mapping of str to str
        What else the recording says of itself: pace, timing, grants of the system.
    """

    recording: Path
    data_sha256: str = ""
    experiment: str = ""
    started_utc: str = ""
    duration_s: float = 0.0
    samples: int = 0
    flagged: int = 0
    software_version: str = ""
    rig_name: str = ""
    rig_text: str = ""
    eds_sha256: Mapping[str, str] = field(default_factory=dict)
    outcome: str = COMPLETE
    settings: Mapping[str, str] = field(default_factory=dict)

    @property
    def rig_sha256(self) -> str:
        """SHA-256 of the rig file's text; empty where there is none."""
        return text_sha256(self.rig_text) if self.rig_text else ""


@dataclass(frozen=True, slots=True)
class Note:
    """What an operator wrote about a run."""

    written_utc: str
    text: str


@dataclass(frozen=True, slots=True)
class Attachment:
    """Something that came of a run: a model, a diagnosis, an identification, an alarm.

    Attributes
    ----------
    kind : str
        Such as ``diagnosis``.
    added_utc : str
        ISO 8601 with offset.
    path : Path or None
        The file it was attached from; None for a document that never was a file.
    document : str
        Its content, text, as it was when it was attached; empty for a file that is not text or too long.
    """

    kind: str
    added_utc: str
    path: Path | None
    document: str

    def as_json(self) -> Any:
        """Return the content of a JSON document; None for one that is none."""
        try:
            return parse_json(self.document)
        except ValueError:
            return None


@dataclass(frozen=True, slots=True)
class Run:
    """One run as the store has it: the entry, and what was said and made of it since, oldest first.

    Attributes
    ----------
    run_id : int
        Its number in the store; never given twice.
    entry : RunEntry
        What was entered.
    verdict : str
        Of the last diagnosis; empty where there is none.
    notes, attachments : tuple
        In a list of runs (`RunStore.find`) the attachments come without their documents.
    alarms : int
        Changes of the driveline that its last on-line estimate found.
    """

    run_id: int
    entry: RunEntry
    verdict: str = ""
    notes: tuple[Note, ...] = ()
    attachments: tuple[Attachment, ...] = ()
    alarms: int = 0

    def latest(self, kind: str) -> Attachment | None:
        """Return the last attachment of a kind."""
        return next((entry for entry in reversed(self.attachments) if entry.kind == kind), None)
