"""Enter a recording into the store of its folder: the one call a command makes when a run is over."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path

from hil.recording.checksum import CHECKSUM, CHECKSUMS, RIG_CHECKSUM, RIG_TEXT
from hil.recording.description import OUTCOME
from hil.recording.recordings import Facts, facts_of, read_facts
from hil.recording.table import Table
from hil.store.entry import COMPLETE, RunEntry
from hil.store.run_store import RunStore

EXPERIMENT, STARTED, VERSION = "experiment", "started_utc", "hil_version"
OWN_KEYS = frozenset({RIG_TEXT, RIG_CHECKSUM, EXPERIMENT, STARTED, VERSION, *CHECKSUMS, OUTCOME, "schema"})
"""What has a place of its own in an entry; the rest is its settings."""


def register_run(
    recording: Path | str,
    outcome: str = COMPLETE,
    folder: Path | str | None = None,
    results: Mapping[str, Path] | None = None,
) -> int:
    """Enter a recording that was just made.

    Parameters
    ----------
    recording : Path or str
        The recording; what is entered is what it says of itself.
    outcome : str
        `COMPLETE`, or what ended the run.
    folder : Path or str, optional
        Of the store; by default the recording's own.
    results : mapping of kind to Path, optional
        What came of it so far, to be attached.

    Returns
    -------
    int
        The run's number in the store.

    Raises
    ------
    RecordingError
        If the recording can't be read.
    StoreError
        If the store can't be written. The recording is whole: ``hil runs rebuild`` enters it later.
    """
    recording = Path(recording)
    entry = entry_at(recording, outcome)
    with RunStore(recording.parent if folder is None else folder) as store:
        run_id = store.add_run(entry)
        for kind, path in (results or {}).items():
            store.attach(run_id, kind, path)
        return run_id


def entry_of(table: Table, outcome: str = COMPLETE) -> RunEntry:
    """Make the entry of a recording from what it says of itself; what ended it early, too, if nobody else knows."""
    return _entry(facts_of(table), outcome)


def entry_at(recording: Path, outcome: str = COMPLETE) -> RunEntry:
    """Make the entry of a recording in a file; as `entry_of`, without holding its rows.

    Raises
    ------
    RecordingError
        If the recording can't be read.
    """
    return _entry(read_facts(recording), outcome)


def _entry(facts: Facts, outcome: str) -> RunEntry:
    said = facts.metadata
    rig_text = said.get(RIG_TEXT, "")
    eds = {key[len("eds_") : -len("_sha256")]: value for key, value in said.items() if _is_eds(key)}
    return RunEntry(
        recording=facts.path,
        data_sha256=said.get(CHECKSUM, ""),
        experiment=said.get(EXPERIMENT, ""),
        started_utc=said.get(STARTED, ""),
        duration_s=facts.extent.duration_s,
        samples=facts.extent.n_rows,
        flagged=facts.extent.flagged,
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
