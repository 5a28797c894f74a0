"""One connection to the store's database, with SQLite's errors put into words.

WAL: a reader never waits for a writer, and what was committed survives a killed process; ``synchronous = FULL`` makes
it survive a power failure too. Several processes may write: each waits for the other up to `BUSY_S`.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hil.errors import StoreError
from hil.store.schema import (
    MIGRATIONS,
    ForeignDatabase,
    UnknownVersion,
    bring_up_to_date,
    columns_of,
    expected_columns,
    roll_back,
)

BUSY_S = 20.0
"""How long a writer waits for another; the longest there is writes one run and its documents, some milliseconds."""

_DAMAGED = frozenset({sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_ERROR})
_FULL = frozenset({sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR})
_UNWRITABLE = frozenset({sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_PERM})
_BUSY = frozenset({sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED})

_PRIMARY = 0xFF
"""Low byte of an extended result code: the primary one (SQLite, Result and Error Codes, section 2)."""


class DamagedStore(StoreError):
    """The store is no whole database any more."""


def open_database(path: Path) -> sqlite3.Connection:
    """Open a store, make it where there is none, bring it up to date.

    Raises
    ------
    DamagedStore
        If it is damaged.
    StoreError
        If it can't be opened, is another program's, or was made by a newer version of this one.
    """
    with in_words(path):
        connection = sqlite3.connect(path, timeout=BUSY_S, isolation_level=None)
        try:
            connection.row_factory = sqlite3.Row
            connection.text_factory = lambda raw: raw.decode("utf-8", "replace")  # SQLite does not check what it keeps
            connection.execute("PRAGMA journal_mode = WAL")
            connection.execute("PRAGMA synchronous = FULL")
            connection.execute("PRAGMA foreign_keys = ON")
            bring_up_to_date(connection)
            _require_whole(path, connection)
        except BaseException:
            connection.close()
            raise
    return connection


def _require_whole(path: Path, connection: sqlite3.Connection) -> None:
    found = connection.execute("PRAGMA quick_check(1)").fetchone()[0]
    if found != "ok":
        raise _damaged(path, found)
    there = columns_of(connection)
    for table, columns in expected_columns().items():
        if missing := columns - there.get(table, set()):
            raise _damaged(path, f"table {table} has no column {', '.join(sorted(missing))}")


@contextmanager
def transaction(path: Path, connection: sqlite3.Connection) -> Iterator[None]:
    """Commit the block whole or not at all; it has the store to itself.

    Raises
    ------
    StoreError
        If the database does not take it; then nothing of it is there.
    """
    with in_words(path):
        connection.execute("BEGIN IMMEDIATE")
        try:
            yield
            connection.execute("COMMIT")
        except BaseException:
            roll_back(connection)
            raise


@contextmanager
def in_words(path: Path) -> Iterator[None]:
    """Say what SQLite's errors in the block mean, and what to do.

    Raises
    ------
    StoreError
        For every one of them.
    """
    try:
        yield
    except UnknownVersion as error:
        raise StoreError(
            path,
            f"expected a store of version {len(MIGRATIONS)} or older, got version {error}: a newer program made it, "
            "or it is damaged. Use that program, or a copy that is whole.",
        ) from error
    except ForeignDatabase as error:
        raise StoreError(
            path, "expected a store of runs, got another program's database. Move it away, or choose another folder."
        ) from error
    except sqlite3.Error as error:
        raise _in_words(path, error) from error
    except UnicodeDecodeError as error:  # the module's, of a message of SQLite's that quotes what is damaged
        raise _damaged(path, error) from error


def _in_words(path: Path, error: sqlite3.Error) -> StoreError:
    extended = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR)
    code = sqlite3.SQLITE_CORRUPT if extended == sqlite3.SQLITE_IOERR_SHORT_READ else extended & _PRIMARY
    if code in _FULL:
        return StoreError(
            path, f"expected room for the entry, got: {error}. Nothing of it was entered; make room and try again."
        )
    if code in _UNWRITABLE:
        return StoreError(
            path,
            f"expected a folder and a file that can be written, got: {error}. Fix their permissions, or copy the "
            "folder to where they can.",
        )
    if code in _BUSY:
        return StoreError(path, f"expected the store within {BUSY_S:g} s, got: {error}. Another program holds it.")
    if code in _DAMAGED:
        return _damaged(path, error)
    raise error  # a constraint or a wrong call: a defect of this program


def _damaged(path: Path, got: object) -> DamagedStore:
    return DamagedStore(
        path,
        f"expected a whole store of runs, got a damaged one ({got}). The recordings are not touched: "
        f"'hil runs rebuild --store {path.parent}' makes it again from them and keeps what can still be read.",
    )
