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
from pathlib import Path

from hil.errors import RecordingError
from hil.parse_json import parse_json
from hil.recording.kinds import Column, Kind
from hil.recording.table import Table

SCHEMA = "hil.recording/1"

OUTCOME = "outcome"
"""Key of the metadata of a run that did not come to its end: what ended it."""


def description_of(table: Table, stored_as: Mapping[str, str]) -> str:
    """Describe a table whose columns are stored under other names."""
    columns = [
        {"name": name, "stored_as": stored_as[name], "unit": table.units.get(name), "kind": Kind.of(column).value}
        for name, column in table.columns.items()
    ]
    return json.dumps({"schema": SCHEMA, "columns": columns, "metadata": dict(table.metadata)})


def described_table(path: Path, text: str, column: Callable[[str, Kind], Column]) -> Table:
    """Read a table by its description."""
    try:
        document = parse_json(text)
        entries = [(str(e["name"]), str(e["stored_as"]), e["unit"], Kind(e["kind"])) for e in document["columns"]]
        metadata = {str(key): str(value) for key, value in document["metadata"].items()}
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise RecordingError(
            path, f"expected a description {SCHEMA} inside, got a damaged one ({error!r}). Take a copy that is whole."
        ) from error
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
    return Table(path, columns, units, metadata)


def metadata_of(path: Path, text: str) -> dict[str, str]:
    """Return the metadata of a description alone."""
    try:
        return {str(key): str(value) for key, value in parse_json(text)["metadata"].items()}
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise RecordingError(
            path, f"expected a description {SCHEMA} inside, got a damaged one ({error!r}). Take a copy that is whole."
        ) from error
