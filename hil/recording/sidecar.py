"""What a CSV recording says of itself, in a JSON file next to it: ``run.csv`` has ``run.csv.json``.

CSV has no place for units, types and metadata, and a comment line would keep other programs from reading the recording.
Where the file is not there, or is some other program's, the recording is read as one that says nothing.

Metadata are keys of their own; ``units`` holds the unit of each column, ``types`` the kind of those columns whose cells
do not tell it: truth values, and texts that could be read as numbers.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hil.errors import RecordingError
from hil.parse_json import read_json
from hil.recording.kinds import Kind
from hil.recording.no_room import no_room

SCHEMA_KEY, SCHEMA = "schema", "hil.recording/1"
"""By which a file of ours is distinguished from any other of that name."""

UNITS_KEY, TYPES_KEY = "units", "types"


@dataclass(frozen=True, slots=True)
class Sidecar:
    """The sidecar of a CSV recording; ``found`` tells whether a file of ours is there at all."""

    metadata: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    types: Mapping[str, Kind] = field(default_factory=dict)
    found: bool = False

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to say."""
        return not (self.metadata or self.units or self.types)


def as_metadata(metadata: Mapping[str, str]) -> dict[str, str]:
    """Leave out what has a meaning of its own in the file next to, and so can't be metadata."""
    return {key: value for key, value in metadata.items() if key not in {SCHEMA_KEY, UNITS_KEY, TYPES_KEY}}


def sidecar_of(recording: Path) -> Path:
    """Name the file next to a recording."""
    return recording.with_name(f"{recording.name}.json")


def write_sidecar(recording: Path, said: Sidecar, needed: bool = False) -> None:
    """Write what a recording says of itself; nothing where it says nothing, unless it is needed all the same."""
    if said.is_empty and not needed:
        return
    path = sidecar_of(recording)
    tables = {UNITS_KEY: dict(said.units), TYPES_KEY: {name: kind.value for name, kind in said.types.items()}}
    document = {**said.metadata, SCHEMA_KEY: SCHEMA, **{key: table for key, table in tables.items() if table}}
    text = json.dumps(document, indent=1, ensure_ascii=False) + "\n"
    unfinished = path.with_name(f".{path.name}.part")
    try:
        unfinished.write_text(text, encoding="utf-8")
        unfinished.replace(path)
    except OSError as error:
        unfinished.unlink(missing_ok=True)
        raise no_room(path, "the description", error) from error


def is_sidecar(path: Path) -> bool:
    """Whether a file is one of ours."""
    try:
        content = read_json(path)
    except (OSError, ValueError):
        return False
    return isinstance(content, dict) and content.get(SCHEMA_KEY) == SCHEMA


def read_sidecar(recording: Path) -> Sidecar:
    """Read what a recording says of itself; empty where no file of ours is next to it."""
    path = sidecar_of(recording)
    if not path.is_file():
        return Sidecar()
    try:
        content = read_json(path)
        if not isinstance(content, dict) or content.get(SCHEMA_KEY) != SCHEMA:
            return Sidecar()
        types = {name: Kind(kind) for name, kind in _texts(content.get(TYPES_KEY)).items()}
    except (OSError, ValueError) as error:
        raise RecordingError(
            path, f"expected the description of {recording.name}, got: {error}. Fix it, or move it away."
        ) from error
    return Sidecar(_texts(content), _texts(content.get(UNITS_KEY)), types, found=True)


def read_sidecar_metadata(recording: Path) -> Mapping[str, str]:
    """Read the metadata alone; see :func:`read_sidecar`."""
    return read_sidecar(recording).metadata


def _texts(content: Any) -> dict[str, str]:
    """Return the entries of a JSON object that are texts."""
    if not isinstance(content, dict):
        return {}
    return {key: value for key, value in content.items() if isinstance(value, str)}
