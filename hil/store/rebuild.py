"""Entering recordings and results: the one just made, or all of a folder, each of which explains itself."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from drivers.foreign_file import read_regular_text
from hil.errors import HilError, RecordingError
from hil.files import read_json, remove_abandoned
from hil.recording.formats import is_named_as_recording, read_metadata
from hil.recording.writer import is_written
from hil.store.entry import COMPLETE, DIAGNOSIS, IDENTIFICATION, ONLINE, Attachment, entry_at, is_run
from hil.store.run_store import DAMAGED, STORE_NAME, RunStore, store_of

ONLINE_SCHEMA, ONLINE_SUFFIX = "hil.online/1", ".online.json"
"""What the on-line estimate of a run is called, after the stem of its recording."""

_FILES = {"diagnosis.json": DIAGNOSIS, "identification.json": IDENTIFICATION}


def register_run(recording: Path, outcome: str = COMPLETE, results: Mapping[str, Path] | None = None) -> int:
    """Enter a recording that was just made."""
    entry = entry_at(recording, outcome)
    with RunStore(recording.parent) as store:
        run_id = store.add_run(entry)
        for kind, path in (results or {}).items():
            store.attach(run_id, kind, path)
        return run_id


def attach_to_runs(recordings: Iterable[Path], results: Mapping[str, Path]) -> list[str]:
    """Attach what was computed from recordings to their runs, where the recordings' folders have a store."""
    folders: dict[Path, set[Path]] = {}
    for recording in recordings:
        if store_of(recording.parent).exists():
            folders.setdefault(recording.parent, set()).add(recording.resolve())
    complaints = []
    for folder, paths in folders.items():
        try:
            with RunStore(folder) as store:
                latest = {run.entry.recording.resolve(): run.run_id for run in store.find()}
                for recording in sorted(paths & latest.keys()):
                    for kind, path in results.items():
                        store.attach(latest[recording], kind, path)
        except HilError as error:
            complaints.append(f"{error}\nThe results are whole; they are not in the store.")
    return complaints


@dataclass(slots=True)
class Rebuilt:
    """What became of the list of a folder."""

    before: int = 0  # runs that were in it
    found: int = 0  # recordings that were entered now
    moved: int = 0  # runs whose recording was found at another place
    copies: int = 0  # recordings with the data of a run whose own is still there, such as conversions
    attached: int = 0  # results (diagnosis.json, identification.json) that were attached now
    unreadable: list[str] = field(default_factory=list)  # a message for each recording that can't be read
    removed: list[Path] = field(default_factory=list)  # unfinished files of processes that were killed


def rebuild(folder: Path) -> Rebuilt:
    """Bring the list of a folder up to what is in the folder and in those in it."""
    with RunStore(folder) as store:
        done = Rebuilt(removed=[path for each in _folders(folder) for path in remove_abandoned(each)])
        _enter(store, done)
        done.attached = _attach_results(store)
    return done


def _enter(store: RunStore, done: Rebuilt) -> None:
    """Enter the recordings that are not in the list yet."""
    known = [run for run in store.find() if not run.entry.outcome.startswith(DAMAGED)]
    here = {(run.entry.recording.resolve(), run.entry.data_sha256) for run in known}
    data = {sha256 for _, sha256 in here if sha256}
    lost = {run.entry.data_sha256: run.run_id for run in known if not run.entry.recording.exists()}
    done.before = len(known)
    for path in _recordings_in(store.folder):
        try:
            if not is_run(read_metadata(path)):
                continue
            entry = entry_at(path)
        except RecordingError as error:
            done.unreadable.append(str(error))
            continue
        sha256 = entry.data_sha256
        if (path.resolve(), sha256) in here:
            continue
        if sha256 and sha256 in lost:
            number = lost.pop(sha256)
            store.move(number, replace(entry, outcome=store.get(number).entry.outcome))
            done.moved += 1
        elif sha256 and sha256 in data:
            done.copies += 1
        else:
            store.add_run(entry)
            done.found += 1
            data |= {sha256} - {""}


def _folders(folder: Path) -> Iterator[Path]:
    yield folder
    yield from (path for path in sorted(folder.rglob("*")) if path.is_dir() and not path.is_symlink())


def _recordings_in(folder: Path) -> Iterator[Path]:
    """Give every file of a recording's suffix in a folder and those in it; not hidden ones, nor one being written."""
    for path in sorted(folder.rglob("*")):
        inside = path.relative_to(folder).parts
        if not is_named_as_recording(path) or any(part.startswith(".") or part == STORE_NAME for part in inside):
            continue
        if path.is_file() and not is_written(path):
            yield path


def _attach_results(store: RunStore) -> int:
    """Attach the results that lie in the folder to the runs they name, once each."""
    attached = 0
    runs = store.find()
    for path in sorted(store.folder.rglob("*.json")):
        if STORE_NAME in path.relative_to(store.folder).parts:
            continue
        for run in runs:
            kind = _kind(path, run.entry.recording)
            if kind and not _has(store.get(run.run_id).attachments, kind, path):
                store.attach(run.run_id, kind, path)
                attached += 1
    return attached


def _kind(path: Path, recording: Path) -> str:
    """Tell what a file is to a recording; empty where it is nothing to it."""
    if path == recording.with_name(f"{recording.stem}{ONLINE_SUFFIX}"):
        return ONLINE
    kind = _FILES.get(path.name, "")
    return kind if kind and recording.stem in recordings_named(path) else ""


def _has(attachments: Iterable[Attachment], kind: str, path: Path) -> bool:
    text = read_regular_text(path, errors="replace")
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
