"""What a CSV recording says of itself, in a JSON file beside it: ``run.csv`` has ``run.csv.json``.

CSV has no place for metadata, and a comment line would keep other programs from reading the recording. Where the file
is not there, or is some other program's, the recording is read as one that says nothing.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from hil.errors import RecordingError

SCHEMA_KEY, SCHEMA = "schema", "hil.recording/1"
"""By which a file of ours is told from any other of that name."""


def sidecar_of(recording: Path) -> Path:
    """Name the file beside a recording."""
    return recording.with_name(f"{recording.name}.json")


def require_no_sidecar(recording: Path) -> None:
    """Refuse to make a recording beside which another one's description lies.

    Raises
    ------
    RecordingError
        If it is there.
    """
    path = sidecar_of(recording)
    try:
        taken = path.exists()
    except OSError as error:
        raise RecordingError(recording, f"expected a place to write, came: {error.strerror}") from error
    if taken:
        raise RecordingError(
            path, "expected a new name, came one that exists: it describes another recording. Move it away."
        )


def write_sidecar(recording: Path, metadata: Mapping[str, str]) -> None:
    """Write what a recording says of itself; nothing where it says nothing.

    Raises
    ------
    RecordingError
        If the disk does not take it.
    """
    if not metadata:
        return
    path = sidecar_of(recording)
    text = json.dumps({**metadata, SCHEMA_KEY: SCHEMA}, indent=1, ensure_ascii=False) + "\n"
    unfinished = path.with_name(f".{path.name}.part")
    try:
        unfinished.write_text(text, encoding="utf-8")
        unfinished.replace(path)
    except OSError as error:
        unfinished.unlink(missing_ok=True)
        raise RecordingError(
            path, f"expected room for the description, came: {error.strerror or error}. The recording itself is whole."
        ) from error


def read_sidecar(recording: Path) -> dict[str, str]:
    """Read what a recording says of itself; empty where no file of ours is beside it.

    Raises
    ------
    RecordingError
        If it is there and can't be read.
    """
    path = sidecar_of(recording)
    if not path.is_file():
        return {}
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise RecordingError(
            path, f"expected the description of {recording.name}, came: {error}. Mend it, or move it away."
        ) from error
    if not isinstance(content, dict) or content.get(SCHEMA_KEY) != SCHEMA:
        return {}
    return {key: value for key, value in content.items() if isinstance(value, str)}
