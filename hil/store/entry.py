"""A run as the list of runs has it: the entry, notes, results, and the facts made of them."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, NonNegativeInt

from hil.files import parse_json
from hil.recording.checksum import CHECKSUM, CHECKSUMS, RIG_CHECKSUM, RIG_TEXT, text_sha256
from hil.recording.description import OUTCOME
from hil.recording.recordings import read_facts

SCHEMA = "hil.runs/1"

COMPLETE = "complete"  # outcome of a run that reached its end; any other is what ended it

DIAGNOSIS, IDENTIFICATION, ONLINE, MODEL = "diagnosis", "identification", "online", "model"
"""Kinds of attachment that mean something here; others are kept all the same."""

EXPERIMENT, STARTED, VERSION = "experiment", "started_utc", "hil_version"
OWN_KEYS = frozenset({RIG_TEXT, RIG_CHECKSUM, EXPERIMENT, STARTED, VERSION, *CHECKSUMS, OUTCOME, "schema"})
"""What has a place of its own in an entry; the rest is its settings."""

_MODE = (("frequency_hz", "resonance [Hz]"), ("damping", "damping"))

_NOT_COMPARED = frozenset({"notes", "attachments", "settings", "eds_sha256", "id", "alarms"})


@dataclass(frozen=True, slots=True, kw_only=True)
class RunEntry:
    """One run as it is entered."""

    recording: Path  # the recording, inside the store's folder
    data_sha256: str = ""  # checksum of its cells (`hil.recording.checksum`)
    experiment: str = ""  # name of the experiment
    started_utc: str = ""  # ISO 8601 with offset
    duration_s: Annotated[float, Field(allow_inf_nan=False)] = 0.0  # N periods of the recording [s]
    samples: NonNegativeInt = 0  # rows
    flagged: NonNegativeInt = 0  # rows with a flag
    software_version: str = ""  # of the program that recorded
    rig_name: str = ""  # empty where the rig file has none
    rig_text: str = ""  # the whole rig file; empty without one
    eds_sha256: Mapping[str, str] = field(default_factory=dict)  # SHA-256 of each EDS the scales were from
    outcome: str = COMPLETE  # `COMPLETE`, or what ended the run
    settings: Mapping[str, str] = field(default_factory=dict)  # what else the recording says of itself

    @property
    def rig_sha256(self) -> str:
        """SHA-256 of the rig file's text; empty where there is none."""
        return text_sha256(self.rig_text) if self.rig_text else ""


@dataclass(frozen=True, slots=True)
class Note:
    """What an operator wrote about a run."""

    written_utc: str  # ISO 8601 with offset
    text: str  # as it was written


@dataclass(frozen=True, slots=True)
class Attachment:
    """Something that came of a run: a model, a diagnosis, an identification, an alarm."""

    kind: str  # such as ``diagnosis``
    added_utc: str  # ISO 8601 with offset
    path: Path | None = None  # the file it was attached from
    document: str = ""  # its content, text, as it was when it was attached
    verdict: str = ""  # of a diagnosis
    alarms: NonNegativeInt = 0  # changes of the driveline that an on-line estimate found

    def as_json(self) -> Any:
        """Return the content of a JSON document; None for one that is none."""
        try:
            return parse_json(self.document)
        except ValueError:
            return None


@dataclass(frozen=True, slots=True)
class Run:
    """One run as the list has it: the entry, and what was said and made of it since, oldest first."""

    run_id: int  # its number
    entry: RunEntry  # what was entered
    notes: tuple[Note, ...] = ()  # oldest first
    # oldest first; in a list of runs (`RunStore.find`) without their documents
    attachments: tuple[Attachment, ...] = ()

    def latest(self, kind: str) -> Attachment | None:
        """Return the last attachment of a kind; None without one."""
        return next((entry for entry in reversed(self.attachments) if entry.kind == kind), None)

    @property
    def verdict(self) -> str:
        """Verdict of the last diagnosis; empty where there is none."""
        last = self.latest(DIAGNOSIS)
        return "" if last is None else last.verdict

    @property
    def alarms(self) -> int:
        """Changes of the driveline that the last on-line estimate found."""
        last = self.latest(ONLINE)
        return 0 if last is None else last.alarms


def attachment_of(kind: str, added_utc: str, path: Path | None, document: str) -> Attachment:
    """Make an attachment, with what a list shows of its document."""
    content = _table(Attachment(kind, added_utc, path, document).as_json())
    verdict = content.get("verdict") if kind == DIAGNOSIS else ""
    alarms = len(found_changes(content)) if kind == ONLINE else 0
    return Attachment(kind, added_utc, path, document, verdict if isinstance(verdict, str) else "", alarms)


def entry_at(recording: Path, outcome: str = COMPLETE) -> RunEntry:
    """Make the entry of a recording from what it says of itself; what ended it early, too, if nobody else knows."""
    said, extent = read_facts(recording)
    rig_text = said.get(RIG_TEXT, "")
    eds = {key[len("eds_") : -len("_sha256")]: value for key, value in said.items() if _is_eds(key)}
    return RunEntry(
        recording=recording,
        data_sha256=said.get(CHECKSUM, ""),
        experiment=said.get(EXPERIMENT, ""),
        started_utc=said.get(STARTED, ""),
        duration_s=extent.duration_s,
        samples=extent.n_rows,
        flagged=extent.flagged,
        software_version=said.get(VERSION, ""),
        rig_name=_rig_name(rig_text),
        rig_text=rig_text,
        eds_sha256=eds,
        outcome=said.get(OUTCOME, COMPLETE) if outcome == COMPLETE else outcome,
        settings={key: value for key, value in said.items() if key not in OWN_KEYS and not _is_eds(key)},
    )


def is_run(metadata: Mapping[str, str]) -> bool:
    """Whether a recording is one of this rig: it says so of itself."""
    return EXPERIMENT in metadata and RIG_TEXT in metadata


def _is_eds(key: str) -> bool:
    return key.startswith("eds_") and key.endswith("_sha256")


def _rig_name(text: str) -> str:
    try:
        name = tomllib.loads(text).get("name", "")
    except (ValueError, RecursionError):  # a recording made before rig files were checked, or by another program
        return ""
    return name if isinstance(name, str) else ""


def found_changes(document: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the alarms of a course, one for each change: one that came before it had settled comes once more."""
    rows = [alarm for alarm in _list(document.get("alarms")) if isinstance(alarm, dict)]
    return [alarm for number, alarm in enumerate(rows) if alarm.get("settled") or number == len(rows) - 1]


def statements(document: Mapping[str, Any]) -> list[str]:
    """Return a line for each change of a course; of one that another program wrote otherwise, what stands there."""
    from estimator.identification.tracking.alarm import Alarm

    lines = []
    for row in found_changes(document):
        try:
            lines.append(Alarm.from_json(row).statement)
        except (KeyError, TypeError, ValueError, ZeroDivisionError):
            lines.append(f"not as this program writes it: {row}")
    return lines


def run_facts(run: Run) -> dict[str, Any]:
    """Return what is known of a run, without its rig file's text and its attachments' content."""
    entry = run.entry
    return {
        "id": run.run_id,
        "recording": str(entry.recording),
        "data_sha256": entry.data_sha256,
        "experiment": entry.experiment,
        "started_utc": entry.started_utc,
        "duration_s": entry.duration_s,
        "samples": entry.samples,
        "flagged": entry.flagged,
        "outcome": entry.outcome,
        "verdict": run.verdict,
        "alarms": run.alarms,
        "rig": entry.rig_name,
        "rig_sha256": entry.rig_sha256,
        "eds_sha256": dict(entry.eds_sha256),
        "software_version": entry.software_version,
        "settings": dict(entry.settings),
        "notes": [{"written_utc": note.written_utc, "text": note.text} for note in run.notes],
        "attachments": [
            {"kind": each.kind, "added_utc": each.added_utc, "path": None if each.path is None else str(each.path)}
            for each in run.attachments
        ],
    }


def results_of(run: Run) -> dict[str, Any]:
    """Return the numbers that came of a run: resonance and damping, and the parameters of its last diagnosis."""
    return {**_resonance(run), **_online(run), **_parameters(run)}


def alarms_of(run: Run) -> list[str]:
    """Return a line for each change of the driveline that the run's last on-line estimate found."""
    return statements(_content(run, ONLINE))


def _resonance(run: Run) -> dict[str, Any]:
    results = map(_table, _list(_content(run, IDENTIFICATION).get("recordings")))
    own = next((entry for entry in results if entry.get("name") == run.entry.recording.stem), {})
    found: dict[str, Any] = {}
    for key, label in (("online", "on line"), ("batch", "off line")):
        mode = _table(_table(own.get(key)).get("resonance"))
        found |= {f"{what} {label}": mode[name] for name, what in _MODE if name in mode}
    return found


def _online(run: Run) -> dict[str, Any]:
    """Return what the estimate that ran along had at its end."""
    document = _content(run, ONLINE)
    mode = _table(_table(document.get("final")).get("resonance"))
    found = {f"{what} while driving": mode[name] for name, what in _MODE if name in mode}
    return found | ({"alarms while driving": run.alarms} if document else {})


def _parameters(run: Run) -> dict[str, Any]:
    document = _content(run, DIAGNOSIS)
    named = [("", document), *((f"{_table(each).get('name')}.", each) for each in _list(document.get("effects")))]
    return {
        f"{prefix}{name} [{_table(entry).get('unit', '')}]": _table(entry).get("value")
        for prefix, owner in named
        for name, entry in _table(_table(owner).get("parameters")).items()
    }


def _content(run: Run, kind: str) -> dict[str, Any]:
    attachment = run.latest(kind)
    return _table(None if attachment is None else attachment.as_json())


def _table(content: Any) -> dict[str, Any]:
    """Return a JSON object; empty where another program wrote something else there."""
    return content if isinstance(content, dict) else {}


def _list(content: Any) -> list[Any]:
    return content if isinstance(content, list) else []


@dataclass(frozen=True, slots=True)
class Difference:
    """One fact of both runs; None where a run does not have it."""

    what: str  # key of `run_facts` or of `results_of`, or EDS of an inverter
    a: Any  # of the first run
    b: Any  # of the second run

    @property
    def differs(self) -> bool:
        """Whether both runs have other values."""
        return bool(self.a != self.b)


@dataclass(frozen=True, slots=True)
class Comparison:
    """Two runs alongside each other; `rig_changes` are the lines of a unified diff of the rig files."""

    rows: tuple[Difference, ...]  # facts of either run, equal ones included
    rig_changes: tuple[str, ...]


def compare_runs(a: Run, b: Run) -> Comparison:
    """Set two runs alongside each other."""
    left, right = _flat(a), _flat(b)
    rows = tuple(Difference(what, left.get(what), right.get(what)) for what in dict.fromkeys([*left, *right]))
    names = (f"run {a.run_id}", f"run {b.run_id}")
    changes = difflib.unified_diff(
        a.entry.rig_text.splitlines(), b.entry.rig_text.splitlines(), *names, lineterm="", n=1
    )
    return Comparison(rows, tuple(changes))


def _flat(run: Run) -> dict[str, Any]:
    facts = {key: value for key, value in run_facts(run).items() if key not in _NOT_COMPARED}
    eds = {f"EDS of {inverter}": sha256 for inverter, sha256 in run.entry.eds_sha256.items()}
    return {**facts, **eds, **results_of(run)}
