"""Results that were computed from recordings, attached to the runs they are of."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from hil.errors import HilError
from hil.parse_json import read_json
from hil.store.entry import DIAGNOSIS, IDENTIFICATION, ONLINE, Attachment
from hil.store.run_store import RunStore, store_of

ONLINE_SCHEMA, ONLINE_SUFFIX = "hil.online/1", ".online.json"
"""What the on-line estimate of a run is called, after the stem of its recording."""

_FILES = {"diagnosis.json": DIAGNOSIS, "identification.json": IDENTIFICATION}


def attach_results(store: RunStore) -> int:
    """Attach the results that lie in the store's folder to the runs they name, once each.

    Returns
    -------
    int
        How many were attached.
    """
    attached = 0
    runs = store.find()
    for path in sorted(store.folder.rglob("*.json")):
        for run in runs:
            kind = _kind(path, run.entry.recording)
            if kind and not _has(store.get(run.run_id).attachments, kind, path):
                store.attach(run.run_id, kind, path)
                attached += 1
    return attached


def attach_to_runs(recordings: Iterable[Path], results: Mapping[str, Path]) -> list[str]:
    """Attach what was computed from recordings to their runs, where the recordings' folders have a store.

    Parameters
    ----------
    recordings : iterable of Path
        What the results are of; those that are no runs of a store are passed over.
    results : mapping of kind to Path
        The files.

    Returns
    -------
    list of str
        What could not be attached, and why, for people: the results themselves are whole.
    """
    complaints = []
    for folder, paths in _by_folder(recordings).items():
        try:
            with RunStore(folder) as store:
                _attach(store, paths, results)
        except HilError as error:
            complaints.append(f"{error}\nThe results are whole; they are not in the store.")
    return complaints


def _by_folder(recordings: Iterable[Path]) -> dict[Path, set[Path]]:
    """Group recordings by their folder, those with a store alone."""
    folders: dict[Path, set[Path]] = {}
    for recording in recordings:
        if store_of(recording.parent).exists():
            folders.setdefault(recording.parent, set()).add(recording.resolve())
    return folders


def _attach(store: RunStore, recordings: set[Path], results: Mapping[str, Path]) -> None:
    latest = {run.entry.recording.resolve(): run.run_id for run in store.find()}
    for recording in sorted(recordings & latest.keys()):
        for kind, path in results.items():
            store.attach(latest[recording], kind, path)


def _kind(path: Path, recording: Path) -> str:
    """Tell what a file is to a recording; empty where it is nothing to it."""
    if path == recording.with_name(f"{recording.stem}{ONLINE_SUFFIX}"):
        return ONLINE
    kind = _FILES.get(path.name, "")
    return kind if kind and recording.stem in recordings_named(path) else ""


def _has(attachments: Sequence[Attachment], kind: str, path: Path) -> bool:
    text = path.read_text(encoding="utf-8", errors="replace")
    return any(entry.kind == kind and entry.document == text for entry in attachments)


def recordings_named(path: Path) -> frozenset[str]:
    """Return the recordings, by stem, that a diagnosis.json or identification.json speaks of."""
    try:
        document = read_json(path)
    except (OSError, ValueError):  # not one of ours, or damaged: it names none
        return frozenset()
    return frozenset(_names(document if isinstance(document, dict) else {}))


def _names(document: dict[str, Any]) -> Iterable[str]:
    entries = document.get("recordings")
    for entry in entries if isinstance(entries, list) else []:
        if isinstance(entry, dict) and isinstance(entry.get("name"), str):
            yield entry["name"]
    mismatch = document.get("mismatch")
    for table in (document.get("load_torque"), mismatch.get("time_s") if isinstance(mismatch, dict) else None):
        yield from table if isinstance(table, dict) else ()
