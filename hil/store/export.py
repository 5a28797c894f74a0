"""Runs out of the store: a table of them, or everything about them in one archive for someone else."""

from __future__ import annotations

import csv
import json
import os
import re
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from hil.errors import UsageError
from hil.recording.formats import FORMATS
from hil.store.entry import Run
from hil.store.facts import SCHEMA, facts_of

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

    Raises
    ------
    UsageError
        If the suffix is another, the name is taken, or the disk does not take it; then nothing is left there.
    """
    write = _WRITERS.get(path.suffix.lower())
    if write is None:
        raise UsageError(f"{path}: expected a name that ends in one of {', '.join(_WRITERS)}, got {path.suffix!r}")
    if path.exists():
        raise UsageError(f"{path}: expected a new name, got one that exists. Move it away.")
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        write(runs, part)
        part.rename(path)
    except OSError as error:
        raise UsageError(
            f"{path}: expected room for the export, got: {error.strerror or error}. Make room, or choose another place."
        ) from error
    finally:
        part.unlink(missing_ok=True)


def _csv(runs: Sequence[Run], path: Path) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, _COLUMNS, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows(facts_of(run) for run in runs)


def _json(runs: Sequence[Run], path: Path) -> None:
    document = {"schema": SCHEMA, "runs": [facts_of(run) for run in runs]}
    path.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def _zip(runs: Sequence[Run], path: Path) -> None:
    """Put each run into a folder of its number: recording, rig file, facts, attachments."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for run in runs:
            home = f"run_{run.run_id}"
            for file in _recording_files(run):
                archive.write(file, f"{home}/{file.name}")
            archive.writestr(f"{home}/run.json", json.dumps(facts_of(run), indent=1, ensure_ascii=False))
            if run.entry.rig_text:
                archive.writestr(f"{home}/rig.toml", run.entry.rig_text)
            for number, attachment in enumerate(run.attachments, start=1):
                name = f"{attachment.kind}.txt" if attachment.path is None else attachment.path.name
                archive.writestr(f"{home}/attachments/{number}_{_plain(name)}", attachment.document)


def _plain(name: str) -> str:
    """Return a name that leads nowhere when someone unpacks the archive."""
    return re.sub(r"[^\w.+-]", "_", name)


def _recording_files(run: Run) -> list[Path]:
    recording = run.entry.recording
    known = FORMATS.get(recording.suffix.lower())
    companion = [] if known is None or known.companion is None else [known.companion(recording)]
    return [file for file in (recording, *companion) if file.is_file()]


_WRITERS: Mapping[str, Callable[[Sequence[Run], Path], None]] = MappingProxyType(
    {".csv": _csv, ".json": _json, ".zip": _zip}
)
