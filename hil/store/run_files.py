"""The files of runs: exported, checked, deleted with what was made with them."""

from __future__ import annotations

import csv
import json
import re
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from hil.errors import RecordingError, UsageError
from hil.files import read_json, whole
from hil.recording.checksum import CHECKSUM
from hil.recording.description import is_sidecar
from hil.recording.formats import FORMATS, read_metadata
from hil.recording.recordings import read_facts
from hil.store.entry import SCHEMA, Run, RunEntry, is_run, run_facts
from hil.store.rebuild import ONLINE_SCHEMA, ONLINE_SUFFIX

VERIFIED = "whole, checksum verified"
UNPROVEN = "readable, it carries no checksum"

_COLUMNS = (
    "id",
    "started_utc",
    "experiment",
    "rig",
    "duration_s",
    "samples",
    "flagged",
    "outcome",
    "verdict",
    "alarms",
    "software_version",
    "recording",
    "data_sha256",
    "rig_sha256",
)


def export_runs(runs: Sequence[Run], path: Path) -> None:
    """Write runs to a new file: ``.csv`` and ``.json`` as a table of facts, ``.zip`` with recordings and all.

    A `UsageError` where the suffix is another, the name is taken, or the disk does not take it.
    """
    write = _WRITERS.get(path.suffix.lower())
    if write is None:
        raise UsageError(f"{path}: expected a name that ends in one of {', '.join(_WRITERS)}, got {path.suffix!r}")
    if path.exists():
        raise UsageError(f"{path}: expected a new name, got one that exists. Move it away.")
    try:
        with whole(path, new=True) as part:
            write(runs, part)
    except OSError as error:
        raise UsageError(
            f"{path}: expected room for the export, got: {error.strerror or error}. Make room, or choose another place."
        ) from error


def _csv(runs: Sequence[Run], path: Path) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, _COLUMNS, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows(run_facts(run) for run in runs)


def _json(runs: Sequence[Run], path: Path) -> None:
    document = {"schema": SCHEMA, "runs": [run_facts(run) for run in runs]}
    path.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def _zip(runs: Sequence[Run], path: Path) -> None:
    """Put each run into a folder of its number: recording, rig file, facts, attachments."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for run in runs:
            home = f"run_{run.run_id}"
            for file in _recording_files(run):
                archive.write(file, f"{home}/{file.name}")
            archive.writestr(f"{home}/run.json", json.dumps(run_facts(run), indent=1, ensure_ascii=False))
            if run.entry.rig_text:
                archive.writestr(f"{home}/rig.toml", run.entry.rig_text)
            for number, attachment in enumerate(run.attachments, start=1):
                name = f"{attachment.kind}.txt" if attachment.path is None else attachment.path.name
                archive.writestr(f"{home}/attachments/{number}_{_plain(name)}", attachment.document)


def _plain(name: str) -> str:
    """Return a name that leads nowhere when someone unpacks the archive."""
    return re.sub(r"[^\w.+-]", "_", name)


def _recording_files(run: Run) -> list[Path]:
    return [file for file in (run.entry.recording, *_companions(run.entry.recording)) if file.is_file()]


def _companions(recording: Path) -> list[Path]:
    known = FORMATS.get(recording.suffix.lower())
    return [] if known is None or known.companion is None else [known.companion(recording)]


_WRITERS: Mapping[str, Callable[[Sequence[Run], Path], None]] = MappingProxyType(
    {".csv": _csv, ".json": _json, ".zip": _zip}
)


def recording_state(entry: RunEntry) -> str:
    """Read the recording of a run and say how it is."""
    if not entry.recording.exists():
        return "missing: it was moved or removed; 'hil runs rebuild' finds it again inside the store's folder"
    try:
        metadata, _ = read_facts(entry.recording)
    except RecordingError as error:
        return "; ".join(error.problems)
    checksum = metadata.get(CHECKSUM, "")
    if checksum != entry.data_sha256:
        return "another recording under the same name: its checksum is not that of this run"
    return VERIFIED if checksum else UNPROVEN


def require_own(entry: RunEntry) -> None:
    """See that the file a run names is its recording: nothing else is deleted. One that is gone passes."""
    path = entry.recording
    if not path.exists():
        return
    try:
        said = read_metadata(path)
    except RecordingError as error:
        raise UsageError(f"{error}\nNothing was deleted; delete the file yourself.") from error
    if not is_run(said) or said.get(CHECKSUM, "") != entry.data_sha256:
        raise UsageError(
            f"{path}: expected the recording of this run, got another file. Nothing was deleted; delete it yourself, "
            "or leave --with-recording out."
        )


def remove_files(entry: RunEntry) -> list[Path]:
    """Delete a recording and what was made with it: its sidecar and the course of its on-line estimate."""
    require_own(entry)
    recording = entry.recording
    course = recording.with_name(f"{recording.stem}{ONLINE_SUFFIX}")
    removed = []
    for path in (*filter(is_sidecar, _companions(recording)), *([course] if _is_course(course) else []), recording):
        try:
            path.unlink()
        except FileNotFoundError:
            continue
        except OSError as error:
            raise UsageError(
                f"{path}: expected a file that can be deleted, got: {error.strerror or error}. The run is out of the "
                "store; delete the file yourself."
            ) from error
        removed.append(path)
    return removed


def _is_course(path: Path) -> bool:
    try:
        document = read_json(path)
    except (OSError, ValueError):
        return False
    return isinstance(document, dict) and document.get("schema") == ONLINE_SCHEMA
