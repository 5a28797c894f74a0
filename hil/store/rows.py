"""A run to the rows of the tables, and back."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hil.store.alarms import COUNT
from hil.store.entry import Attachment, Note, Run, RunEntry
from hil.store.filters import VERDICT
from hil.store.row_faults import faults_of, mended

_RUNS = (
    "SELECT runs.*, coalesce(rig_files.name, '') AS rig_name, coalesce(rig_files.text, '') AS rig_text, "
    f"coalesce({VERDICT}, '') AS verdict, coalesce({COUNT}, 0) AS alarms "
    "FROM runs LEFT JOIN rig_files ON rig_files.sha256 = runs.rig_sha256 "
)

_SAME_NAME = (
    "data_sha256",
    "experiment",
    "started_utc",
    "duration_s",
    "samples",
    "flagged",
    "software_version",
    "outcome",
)
"""Columns of ``runs`` that are attributes of the entry, as they are."""


def insert_run(
    database: sqlite3.Connection, entry: RunEntry, recording: str, added_utc: str, run_id: int | None = None
) -> int:
    """Enter a run, inside a transaction of the caller's; `recording` is relative to the store's folder.

    It gets the next number, unless it has one already.
    """
    if entry.rig_text:
        database.execute(
            "INSERT OR IGNORE INTO rig_files VALUES (?, ?, ?)", (entry.rig_sha256, entry.rig_name, entry.rig_text)
        )
    row: dict[str, Any] = {
        "id": run_id,
        "added_utc": added_utc,
        "recording": recording,
        "rig_sha256": entry.rig_sha256 or None,
        "settings": json.dumps(dict(entry.settings), ensure_ascii=False),
        **{name: getattr(entry, name) for name in _SAME_NAME},
    }
    places = ", ".join("?" * len(row))
    cursor = database.execute(f"INSERT INTO runs ({', '.join(row)}) VALUES ({places})", tuple(row.values()))
    given = int(cursor.lastrowid or 0)
    database.executemany(
        "INSERT INTO eds VALUES (?, ?, ?)", [(given, inverter, sha) for inverter, sha in entry.eds_sha256.items()]
    )
    return given


def read_runs(
    database: sqlite3.Connection, folder: Path, condition: str, values: Sequence[Any], with_documents: bool = True
) -> list[Run]:
    """Return the runs that fulfil an SQL condition, oldest first."""
    rows = database.execute(f"{_RUNS} WHERE {condition} ORDER BY runs.started_utc, runs.id", values).fetchall()
    document = "document" if with_documents else "'' AS document"
    return [_run(database, folder, row, document) for row in rows]


def _run(database: sqlite3.Connection, folder: Path, read: sqlite3.Row, document: str) -> Run:
    run_id = int(read["id"])
    faults = faults_of(folder, dict(read))
    row = mended(dict(read), faults)
    if faults:
        row["outcome"] = _damaged(faults, folder)

    def of_run(query: str) -> list[sqlite3.Row]:
        return database.execute(query, (run_id,)).fetchall()

    entry = RunEntry(
        recording=folder / row["recording"],
        rig_name=str(row["rig_name"]),
        rig_text=str(row["rig_text"]),
        eds_sha256={
            str(inverter): str(sha256)
            for inverter, sha256 in of_run("SELECT inverter, sha256 FROM eds WHERE run_id = ?")
        },
        settings=json.loads(row["settings"]),
        **{name: row[name] for name in _SAME_NAME},
    )
    notes = of_run("SELECT written_utc, text FROM notes WHERE run_id = ? ORDER BY id")
    attached = of_run(f"SELECT kind, added_utc, path, {document} FROM attachments WHERE run_id = ? ORDER BY id")
    return Run(
        run_id,
        entry,
        str(row["verdict"]),
        tuple(Note(str(written_utc), str(text)) for written_utc, text in notes),
        tuple(
            Attachment(str(kind), str(added_utc), None if path is None else folder / str(path), str(text))
            for kind, added_utc, path, text in attached
        ),
        int(row["alarms"]),
    )


def _damaged(faults: Sequence[str], folder: Path) -> str:
    return (
        f"damaged in the store ({', '.join(faults)}). 'hil runs rebuild --store {folder}' reads the run again from its "
        "recording"
    )
