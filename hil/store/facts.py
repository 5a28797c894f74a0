"""A run in plain facts: one dictionary for JSON, tables, comparison and export."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hil.store.alarms import statements
from hil.store.entry import DIAGNOSIS, IDENTIFICATION, ONLINE, Run

SCHEMA = "hil.runs/1"


def facts_of(run: Run) -> dict[str, Any]:
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
            {"kind": entry.kind, "added_utc": entry.added_utc, "path": None if entry.path is None else str(entry.path)}
            for entry in run.attachments
        ],
    }


def results_of(run: Run) -> dict[str, Any]:
    """Return the numbers that came of a run: resonance and damping, and the parameters of its last diagnosis."""
    return {**_resonance(run), **_online(run), **_parameters(run)}


def _resonance(run: Run) -> dict[str, Any]:
    document = _content(run, IDENTIFICATION)
    results = [entry for entry in _list(document.get("recordings")) if isinstance(entry, dict)]
    own = next((entry for entry in results if entry.get("name") == Path(run.entry.recording).stem), None)
    found: dict[str, Any] = {}
    for key, label in (("online", "on line"), ("batch", "off line")):
        mode = _table(_table(_table(own).get(key)).get("resonance"))
        found |= {f"{what} {label}": mode[name] for name, what in _MODE if name in mode}
    return found


def _online(run: Run) -> dict[str, Any]:
    """Return what the estimate that ran along had at its end."""
    document = _content(run, ONLINE)
    mode = _table(_table(document.get("final")).get("resonance"))
    found = {f"{what} while driving": mode[name] for name, what in _MODE if name in mode}
    return found | ({"alarms while driving": run.alarms} if document else {})


def alarms_of(run: Run) -> list[str]:
    """Return a line for each change of the driveline that the run's last on-line estimate found."""
    return statements(_content(run, ONLINE))


_MODE = (("frequency_hz", "resonance [Hz]"), ("damping", "damping"))


def _parameters(run: Run) -> dict[str, Any]:
    document = _content(run, DIAGNOSIS)
    found = {
        f"{name} [{_table(entry).get('unit', '')}]": _table(entry).get("value")
        for name, entry in _table(document.get("parameters")).items()
    }
    for effect in _list(document.get("effects")):
        for name, entry in _table(_table(effect).get("parameters")).items():
            found[f"{effect.get('name')}.{name} [{_table(entry).get('unit', '')}]"] = _table(entry).get("value")
    return found


def _content(run: Run, kind: str) -> dict[str, Any]:
    attachment = run.latest(kind)
    return _table(None if attachment is None else attachment.as_json())


def _table(content: Any) -> dict[str, Any]:
    """Return a JSON object; empty where another program wrote something else there."""
    return content if isinstance(content, dict) else {}


def _list(content: Any) -> list[Any]:
    return content if isinstance(content, list) else []
