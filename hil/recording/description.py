"""What a recording says of itself, as one JSON document inside the file: ``hil.recording/1``.

::

    {"schema": "hil.recording/1",
     "columns": [{"name": "time_s", "stored_as": "time_s", "unit": "s", "kind": "float"}, ...],
     "metadata": {"experiment": "cruise", "rig_file": "...", "data_sha256": "...", ...}}

Formats with names, units or types of their own carry those as well, for other programs; what the document says counts,
for few of them take every name, and none every text. It is plain ASCII: JSON escapes the rest.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hil.errors import RecordingError
from hil.files import parse_json, read_json, write_whole
from hil.recording.bounds import no_room
from hil.recording.table import Column, ColumnKind, Table

SCHEMA = "hil.recording/1"

OUTCOME = "outcome"  # key of the metadata of a run that did not come to its end: what ended it

_DAMAGED = (ValueError, KeyError, TypeError, AttributeError)

SCHEMA_KEY, UNITS_KEY, TYPES_KEY = "schema", "units", "types"


def description_of(table: Table, stored_as: Mapping[str, str]) -> str:
    """Describe a table whose columns are stored under other names."""
    columns = [
        {"name": name, "stored_as": stored_as[name], "unit": table.units.get(name), "kind": ColumnKind.of(column).value}
        for name, column in table.columns.items()
    ]
    return json.dumps({"schema": SCHEMA, "columns": columns, "metadata": dict(table.metadata)})


def described_table(path: Path, text: str, column: Callable[[str, ColumnKind], Column]) -> Table:
    """Return the table of a description, its columns by ``column``; `RecordingError` where it is damaged."""
    document = _document(path, text)
    try:
        entries = [(str(e["name"]), str(e["stored_as"]), e["unit"], ColumnKind(e["kind"])) for e in document["columns"]]
    except _DAMAGED as error:
        raise _damaged(path, error) from error
    columns, units = {}, {}
    for name, stored_as, unit, kind in entries:
        try:
            columns[name] = column(stored_as, kind)
        except KeyError as error:
            raise RecordingError(
                path, f"column {name}: expected it under the name {stored_as}, got none: it is damaged or was changed."
            ) from error
        if unit is not None:
            units[name] = str(unit)
    return Table(path, columns, units, document["metadata"])


def metadata_of(path: Path, text: str) -> dict[str, str]:
    """Return the metadata of a description; `RecordingError` where it is damaged."""
    metadata: dict[str, str] = _document(path, text)["metadata"]
    return metadata


def _document(path: Path, text: str) -> dict[str, Any]:
    """Read a description; its metadata are texts."""
    try:
        document = parse_json(text)
        return {**document, "metadata": {str(key): str(value) for key, value in document["metadata"].items()}}
    except _DAMAGED as error:
        raise _damaged(path, error) from error


def _damaged(path: Path, error: Exception) -> RecordingError:
    return RecordingError(
        path, f"expected a description {SCHEMA} inside, got a damaged one ({error!r}). Take a copy that is whole."
    )


@dataclass(frozen=True, slots=True)
class Sidecar:
    """The sidecar of a CSV recording; ``found`` tells whether a file of ours is there at all."""

    # every entry that is a text, the schema included where it was read
    metadata: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)  # by column; columns without a unit are left out
    # of columns whose text alone does not tell their kind
    types: Mapping[str, ColumnKind] = field(default_factory=dict)
    found: bool = False

    @property
    def is_empty(self) -> bool:
        """Whether it says nothing."""
        return not (self.metadata or self.units or self.types)


NO_SIDECAR = Sidecar()


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
    try:
        write_whole(path, text)
    except OSError as error:
        raise no_room(path, "the description", error) from error


def is_sidecar(path: Path) -> bool:
    """Whether a file is one of ours."""
    try:
        return _is_ours(read_json(path))
    except (OSError, ValueError):
        return False


def _is_ours(content: Any) -> bool:
    return isinstance(content, dict) and content.get(SCHEMA_KEY) == SCHEMA


def read_sidecar(recording: Path) -> Sidecar:
    """Read what a recording says of itself; empty where no file of ours is next to it."""
    path = sidecar_of(recording)
    if not path.is_file():
        return Sidecar()
    try:
        content = read_json(path)
        if not _is_ours(content):
            return Sidecar()
        types = {name: ColumnKind(kind) for name, kind in _texts(content.get(TYPES_KEY)).items()}
    except (OSError, ValueError) as error:
        raise RecordingError(
            path, f"expected the description of {recording.name}, got: {error}. Fix it, or move it away."
        ) from error
    return Sidecar(_texts(content), _texts(content.get(UNITS_KEY)), types, found=True)


def read_sidecar_metadata(recording: Path) -> Mapping[str, str]:
    """Return the metadata of `read_sidecar`, which raises where the file is damaged."""
    return read_sidecar(recording).metadata


def _texts(content: Any) -> dict[str, str]:
    """Return the entries of a JSON object that are texts."""
    if not isinstance(content, dict):
        return {}
    return {key: value for key, value in content.items() if isinstance(value, str)}
