"""What can still be read of a damaged store.

SQLite keeps a table as a tree of pages, and a damaged page hides the rows behind it: a table is read from its
beginning up to the damage, and from its end back to it. All is done on a copy; the damaged file is not touched.
"""

from __future__ import annotations

import contextlib
import shutil
import sqlite3
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

TABLES = {
    "rig_files": "sha256",
    "runs": "id",
    "eds": "rowid",
    "notes": "id",
    "attachments": "id",
}
"""In the order in which they refer to each other, each with what identifies its rows."""

_NAMES = "sqlite_autoindex_runs_1"
"""The index of UNIQUE (recording, data_sha256), as SQLite names it."""

Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Salvaged:
    """What could be read.

    Attributes
    ----------
    tables : mapping of table to list of rows
        Row by row, as it was.
    names : mapping of run to (recording, data_sha256)
        Of every run the index still knows, also where the run's own page is lost: enough to read it again from its
        recording, under the number that its notes refer to.
    """

    tables: dict[str, list[Row]]
    names: dict[int, tuple[str, str]]


def salvage(store: Path) -> Salvaged:
    """Return what can be read of a store; nothing where the file is no database any more."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / store.name
        for suffix in ("", "-wal"):
            with contextlib.suppress(FileNotFoundError):
                shutil.copyfile(f"{store}{suffix}", f"{copy}{suffix}")
        connection = sqlite3.connect(copy)
        try:
            connection.row_factory = sqlite3.Row
            connection.text_factory = lambda raw: raw.decode("utf-8", "replace")
            tables = {
                table: _rows(connection, f"SELECT *, {key} AS place FROM {table}") for table, key in TABLES.items()
            }
            index = _rows(connection, f"SELECT id, id AS place, recording, data_sha256 FROM runs INDEXED BY {_NAMES}")
            return Salvaged(tables, {row["id"]: (row["recording"], row["data_sha256"]) for row in index})
        finally:
            connection.close()


def _rows(connection: sqlite3.Connection, query: str) -> list[Row]:
    found: dict[Any, Row] = {}
    for order in ("ASC", "DESC"):
        # The damage ends the reading; what came before it counts.
        with contextlib.suppress(sqlite3.DatabaseError, UnicodeDecodeError):
            for row in connection.execute(f"{query} ORDER BY place {order}"):
                found.setdefault(row["place"], {name: row[name] for name in row.keys() if name != "place"})
    return list(found.values())
