"""A new store, of what can be read of a damaged one, in its place; the damaged one is put aside."""

from __future__ import annotations

import contextlib
import os
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from hil.errors import RecordingError
from hil.inside import is_inside
from hil.store.connection import DamagedStore, in_words, open_database, transaction
from hil.store.entry import RunEntry
from hil.store.register import entry_at
from hil.store.row_faults import faults_of, mended
from hil.store.rows import insert_run
from hil.store.run_store import store_of
from hil.store.salvage import TABLES, Row, Salvaged, salvage
from hil.store.schema import columns_of

PARTS = ("", "-wal", "-shm")
"""What SQLite keeps next to a database in WAL mode."""


@dataclass(frozen=True, slots=True)
class Replaced:
    """Where the damaged store is now, and the notes to runs of which nothing else is left."""

    aside: Path
    lost_notes: tuple[str, ...]


def replace_if_damaged(folder: Path) -> Replaced | None:
    """Replace the store of a folder where it is damaged; None where it is whole, or there is none.

    Raises
    ------
    StoreError
        If it can't be opened for another reason, or the new one can't be written.
    """
    path = store_of(folder)
    if not path.exists():
        return None
    try:
        database = open_database(path)
        try:
            with in_words(path):
                rows = [dict(row) for row in database.execute("SELECT * FROM runs")]
        finally:
            database.close()
    except DamagedStore:
        return _replace(path)
    return _replace(path) if any(faults_of(folder, row) for row in rows) else None


def _replace(path: Path) -> Replaced:
    fresh = path.with_name(f".{path.name}.{os.getpid()}.new")
    aside = path.with_name(f"{path.name}.damaged-{datetime.now(UTC):%Y%m%dT%H%M%SZ}")
    try:
        lost_notes = _fill(fresh, path.parent, salvage(path))
        for part in PARTS:
            with contextlib.suppress(FileNotFoundError):
                os.replace(f"{path}{part}", f"{aside}{part}")
        fresh.replace(path)
    finally:
        for part in PARTS:
            Path(f"{fresh}{part}").unlink(missing_ok=True)
    return Replaced(aside, lost_notes)


def _fill(path: Path, folder: Path, salvaged: Salvaged) -> tuple[str, ...]:
    """Make a store of what was read; return the notes whose run is lost."""
    lost_notes: list[str] = []
    database = open_database(path)
    try:
        with transaction(path, database):
            known = columns_of(database)
            for table in TABLES:
                rows = [{name: row[name] for name in row if name in known[table]} for row in salvaged.tables[table]]
                if table == "runs":
                    _fill_runs(database, folder, rows, salvaged)
                    continue
                for row in rows:
                    if "run_id" in row and not _has(database, "runs", "id", row["run_id"]):
                        lost_notes += [str(row.get("text", ""))] if table == "notes" else []
                    else:
                        _insert(database, table, row)
        database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    finally:
        database.close()
    return tuple(lost_notes)


def _fill_runs(database: sqlite3.Connection, folder: Path, rows: Sequence[Row], salvaged: Salvaged) -> None:
    """Enter the runs: those whose row is whole, those that their recording still tells, and what is left of others."""
    faults = [faults_of(folder, row) for row in rows]
    for row, found in zip(rows, faults, strict=True):
        if not found:
            _insert(database, "runs", row)
    _read_again(database, folder, salvaged)
    for row, found in zip(rows, faults, strict=True):
        if found and not _has(database, "runs", "id", row.get("id")):
            _insert(database, "runs", mended(row, found))


def _read_again(database: sqlite3.Connection, folder: Path, salvaged: Salvaged) -> None:
    """Enter the runs of which only the name is left, from their recordings, under their numbers."""
    for run_id, (recording, data_sha256) in salvaged.names.items():
        if _has(database, "runs", "id", run_id) or not is_inside(folder, folder / str(recording)):
            continue
        if entry := _entry(folder / recording, data_sha256):
            insert_run(database, entry, recording, datetime.now(UTC).isoformat(timespec="seconds"), run_id)


def _entry(recording: Path, data_sha256: str) -> RunEntry | None:
    try:
        entry = entry_at(recording)
    except RecordingError:  # the rebuilding that follows reads it again, and tells
        return None
    return entry if entry.data_sha256 == data_sha256 else None


def _insert(database: sqlite3.Connection, table: str, row: Row) -> None:
    if table == "runs" and not _has(database, "rig_files", "sha256", row.get("rig_sha256")):
        row = {**row, "rig_sha256": None}
    places = ", ".join("?" * len(row))
    database.execute(f"INSERT OR IGNORE INTO {table} ({', '.join(row)}) VALUES ({places})", tuple(row.values()))


def _has(database: sqlite3.Connection, table: str, key: str, value: object) -> bool:
    return database.execute(f"SELECT 1 FROM {table} WHERE {key} = ?", (value,)).fetchone() is not None
