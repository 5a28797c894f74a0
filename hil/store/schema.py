"""The store's tables, and the steps from each version of them to the next.

A step is SQL that is carried out once, in one transaction with the change of the version; a store made by a newer
program is refused, for what it means can't be known here.
"""

from __future__ import annotations

import sqlite3
from typing import Final

APPLICATION_ID: Final = 0x48494C52
"""``HILR``: by which SQLite's own header tells this store from any other database."""

_FIRST: Final = """
CREATE TABLE rig_files (sha256 TEXT PRIMARY KEY, name TEXT NOT NULL, text TEXT NOT NULL);
CREATE TABLE runs (
    id INTEGER PRIMARY KEY AUTOINCREMENT,  -- a number is never given twice: people write them down
    added_utc TEXT NOT NULL,
    recording TEXT NOT NULL,               -- relative to the store's folder
    data_sha256 TEXT NOT NULL,
    experiment TEXT NOT NULL,
    started_utc TEXT NOT NULL,
    duration_s REAL NOT NULL,
    samples INTEGER NOT NULL,
    flagged INTEGER NOT NULL,
    software_version TEXT NOT NULL,
    rig_sha256 TEXT REFERENCES rig_files (sha256),
    outcome TEXT NOT NULL,
    settings TEXT NOT NULL,                -- JSON object of text
    UNIQUE (recording, data_sha256)
);
CREATE INDEX runs_by_start ON runs (started_utc);
CREATE TABLE eds (
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,
    inverter TEXT NOT NULL,
    sha256 TEXT NOT NULL,
    PRIMARY KEY (run_id, inverter)
);
CREATE TABLE notes (
    id INTEGER PRIMARY KEY,
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,
    written_utc TEXT NOT NULL,
    text TEXT NOT NULL
);
CREATE TABLE attachments (
    id INTEGER PRIMARY KEY,
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,
    kind TEXT NOT NULL,
    added_utc TEXT NOT NULL,
    path TEXT,                             -- relative to the store's folder where it is inside
    document TEXT NOT NULL
);
CREATE INDEX notes_of_run ON notes (run_id);
CREATE INDEX attachments_of_run ON attachments (run_id);
"""

MIGRATIONS: tuple[str, ...] = (_FIRST,)
"""Step k leads from version k to version k + 1."""


class UnknownVersion(Exception):
    """The store is of a version that this program does not know: a newer one, or none at all."""


class ForeignDatabase(Exception):
    """The file is some other program's database."""


def bring_up_to_date(connection: sqlite3.Connection) -> None:
    """Make the tables, or carry out the steps that are missing; several processes may do so at once.

    Raises
    ------
    UnknownVersion, ForeignDatabase
        If it can't be this program's to change.
    """
    if _version(connection) == len(MIGRATIONS) and _pragma(connection, "application_id") == APPLICATION_ID:
        return
    connection.execute("BEGIN IMMEDIATE")
    try:
        _require_ours(connection)
        for number in range(_version(connection), len(MIGRATIONS)):
            for statement in _statements(MIGRATIONS[number]):
                connection.execute(statement)
        connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        connection.execute(f"PRAGMA user_version = {len(MIGRATIONS)}")
        connection.execute("COMMIT")
    except BaseException:
        roll_back(connection)
        raise


def columns_of(connection: sqlite3.Connection) -> dict[str, set[str]]:
    """Return the columns of every table of a store."""
    tables = [str(row[0]) for row in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
    return {
        table: {str(row[0]) for row in connection.execute("SELECT name FROM pragma_table_info(?)", (table,))}
        for table in tables
    }


def expected_columns() -> dict[str, set[str]]:
    """Return the columns that a store of this version has."""
    connection = sqlite3.connect(":memory:", isolation_level=None)
    try:
        bring_up_to_date(connection)
        return columns_of(connection)
    finally:
        connection.close()


def roll_back(connection: sqlite3.Connection) -> None:
    """Undo the transaction that is open; a full disk has ended it already."""
    if connection.in_transaction:
        connection.execute("ROLLBACK")


def _require_ours(connection: sqlite3.Connection) -> None:
    version, owner = _version(connection), _pragma(connection, "application_id")
    is_empty = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0] == 0
    if owner != APPLICATION_ID and not is_empty:
        raise ForeignDatabase
    if not 0 <= version <= len(MIGRATIONS):
        raise UnknownVersion(version)


def _statements(script: str) -> list[str]:
    """Cut a script into statements: `executescript` would commit the transaction that holds them together."""
    statements, open_one = [], ""
    for line in script.splitlines(keepends=True):
        open_one += line
        if sqlite3.complete_statement(open_one):
            statements.append(open_one)
            open_one = ""
    return statements


def _version(connection: sqlite3.Connection) -> int:
    return _pragma(connection, "user_version")


def _pragma(connection: sqlite3.Connection, name: str) -> int:
    return int(connection.execute(f"PRAGMA {name}").fetchone()[0])
