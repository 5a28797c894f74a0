"""Runs in and out of the store."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from hil.errors import StoreError, UsageError
from hil.store.connection import in_words, open_database, transaction
from hil.store.entry import Run, RunEntry
from hil.store.filters import RunFilter
from hil.store.rows import insert_run, read_runs

STORE_NAME = "runs.sqlite"

LONGEST_DOCUMENT_BYTES = 16 << 20
"""A longer attached file is known by its name only."""


def store_of(folder: Path | str) -> Path:
    """Name the store of a folder."""
    return Path(folder) / STORE_NAME


class RunStore:
    """The runs of one folder; a context manager. Every call is committed, whole or not at all, when it returns.

    Parameters
    ----------
    folder : Path or str
        Where the recordings are; ``runs.sqlite`` is made there where it is not.

    Raises
    ------
    StoreError
        On entry and from every call: if the store is damaged, can't be written, or is not one of this program.
    """

    def __init__(self, folder: Path | str) -> None:
        self.folder = Path(folder)
        self.path = store_of(self.folder)
        self._open: sqlite3.Connection | None = None

    def __enter__(self) -> Self:
        if not self.folder.is_dir():
            raise StoreError(self.path, f"expected an existing folder, got {self.folder}. Make it first.")
        self._open = open_database(self.path)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._open is not None:
            self._open.close()
            self._open = None

    @property
    def _database(self) -> sqlite3.Connection:
        if self._open is None:
            raise StoreError(self.path, "expected an open store, got one that is closed. Use it by 'with'.")
        return self._open

    def add_run(self, entry: RunEntry) -> int:
        """Enter a run; one that is there already, the same file with the same data, keeps its number.

        Returns
        -------
        int
            Its number.
        """
        recording = self._inside(entry.recording)
        with transaction(self.path, self._database):
            known = self._database.execute(
                "SELECT id FROM runs WHERE recording = ? AND data_sha256 = ?", (recording, entry.data_sha256)
            ).fetchone()
            return int(known["id"]) if known is not None else insert_run(self._database, entry, recording, _now_utc())

    def attach(self, run_id: int, kind: str, content: Path | str | Mapping[str, Any]) -> None:
        """Add something that came of a run.

        Parameters
        ----------
        run_id : int
            The run.
        kind : str
            ``model``, ``diagnosis``, ``identification``, ``alarm``, or a word of your own.
        content : Path, str, or mapping
            A file, whose text is kept as it is now; a text; or a document to be kept as JSON.

        Raises
        ------
        UsageError
            If there is no such run, or the file can't be read.
        """
        path = self._relative(content) if isinstance(content, Path) else None
        document = _document(content)
        with transaction(self.path, self._database):
            self._require(run_id)
            self._database.execute(
                "INSERT INTO attachments (run_id, kind, added_utc, path, document) VALUES (?, ?, ?, ?, ?)",
                (run_id, kind, _now_utc(), path, document),
            )

    def note(self, run_id: int, text: str) -> None:
        """Add an operator's note to a run.

        Raises
        ------
        UsageError
            If there is no such run, or the note is empty.
        """
        if not text.strip():
            raise UsageError("expected a note, got an empty one")
        with transaction(self.path, self._database):
            self._require(run_id)
            self._database.execute(
                "INSERT INTO notes (run_id, written_utc, text) VALUES (?, ?, ?)", (run_id, _now_utc(), text)
            )

    def move(self, run_id: int, recording: Path) -> None:
        """Tell where the recording of a run is now.

        Raises
        ------
        UsageError
            If there is no such run.
        """
        with transaction(self.path, self._database):
            self._require(run_id)
            self._database.execute("UPDATE runs SET recording = ? WHERE id = ?", (self._inside(recording), run_id))

    def find(self, wanted: RunFilter | None = None) -> list[Run]:
        """Return the runs that are asked for, all without a filter, oldest first; attachments without documents."""
        condition, values = (wanted or RunFilter()).where()
        with in_words(self.path):
            return read_runs(self._database, self.folder, condition, values, with_documents=False)

    def get(self, run_id: int) -> Run:
        """Return one run.

        Raises
        ------
        UsageError
            If there is no such run.
        """
        with in_words(self.path):
            found = read_runs(self._database, self.folder, "runs.id = ?", [run_id])
        if not found:
            raise self._no_such(run_id)
        return found[0]

    def delete(self, run_id: int) -> Run:
        """Take a run out, with its notes and attachments; no file is touched.

        Returns
        -------
        Run
            What was taken out.

        Raises
        ------
        UsageError
            If there is no such run.
        """
        with transaction(self.path, self._database):
            run = self.get(run_id)
            self._database.execute("DELETE FROM runs WHERE id = ?", (run_id,))
            self._database.execute(
                "DELETE FROM rig_files WHERE sha256 NOT IN (SELECT rig_sha256 FROM runs WHERE rig_sha256 IS NOT NULL)"
            )
        return run

    def _require(self, run_id: int) -> None:
        if self._database.execute("SELECT 1 FROM runs WHERE id = ?", (run_id,)).fetchone() is None:
            raise self._no_such(run_id)

    def _no_such(self, run_id: int) -> UsageError:
        return UsageError(f"{self.path}: expected the number of a run, got {run_id}, which is none. See: hil runs")

    def _inside(self, recording: Path) -> str:
        """Name a recording relative to the folder, so that both can be moved together."""
        resolved = recording.resolve()
        if not resolved.is_relative_to(self.folder.resolve()):
            raise StoreError(
                self.path, f"expected a recording inside {self.folder}, got {recording}. Use the store of its folder."
            )
        return resolved.relative_to(self.folder.resolve()).as_posix()

    def _relative(self, path: Path) -> str:
        resolved, home = path.resolve(), self.folder.resolve()
        return resolved.relative_to(home).as_posix() if resolved.is_relative_to(home) else str(resolved)


def _document(content: Path | str | Mapping[str, Any]) -> str:
    if isinstance(content, str):
        return content
    if isinstance(content, Mapping):
        return json.dumps(content, ensure_ascii=False)
    try:
        raw = content.read_bytes()
    except OSError as error:
        raise UsageError(f"{content}: expected a file to attach, got: {error.strerror or error}") from error
    try:
        return raw.decode("utf-8") if len(raw) <= LONGEST_DOCUMENT_BYTES else ""
    except UnicodeDecodeError:
        return ""  # not text: known by its name


def _now_utc() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
