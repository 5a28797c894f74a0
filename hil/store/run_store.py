"""Runs in and out of the list: a small file for each run, note and result, in a folder next to the recordings.

::

    hil_runs/3.json               the run: what its recording says of itself
    hil_runs/3.note_1.json        a note
    hil_runs/3.result_1.json      a result: kind, date, and where it came from
    hil_runs/3.result_1.document  its text, as it was

A file is written whole or not at all and none is changed, so several programs may write at once. A run that is deleted
leaves its number, for people write numbers down. The folder may be someone else's: what is read of it is checked, and
what can't be used is shown as damaged and hides nothing else.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, Literal, Self, TypeVar

from pydantic import TypeAdapter, ValidationError

from drivers.foreign_file import read_regular, read_regular_text
from hil.errors import StoreError, UsageError
from hil.files import is_inside, read_json, write_whole
from hil.store.entry import Attachment, Note, Run, RunEntry, attachment_of

STORE_NAME: Final = "hil_runs"

SCHEMA: Final = "hil.run_card/1"

LONGEST_DOCUMENT_BYTES: Final = 16 << 20  # a longer attached file is known by its name only

DAMAGED: Final = "damaged in the list of runs"

_NAME: Final = re.compile(r"(?P<run>[1-9][0-9]{0,8})(\.(?P<what>note|result)_(?P<number>[1-9][0-9]{0,8}))?\.json")

_RUN: Final = TypeAdapter(RunEntry)
_NOTE: Final = TypeAdapter(Note)
_RESULT: Final = TypeAdapter(Attachment)

T = TypeVar("T")

AttachmentOf = Literal["note", "result"]


def store_of(folder: Path | str) -> Path:
    """Return the folder of the store of a folder of recordings, be it there or not."""
    return Path(folder) / STORE_NAME


@dataclass(frozen=True, slots=True, kw_only=True)
class RunFilter:
    """All that is given must hold; nothing given: every run."""

    experiment: str = ""  # name of the experiment
    since: str = ""  # ISO 8601 or its beginning, compared as text: started then or later
    until: str = ""  # ISO 8601 or its beginning, compared as text: started then or before
    rig: str = ""  # name of the rig, or the beginning of its rig file's SHA-256
    verdict: str = ""  # of the last diagnosis
    text: str = ""  # somewhere in names, rig file, notes or documents, in capitals or not

    def takes(self, run: Run) -> bool:
        """Whether all that is asked holds of a run; with `text`, of one with its documents."""
        entry = run.entry
        started = entry.started_utc
        return (
            (not self.experiment or entry.experiment == self.experiment)
            and (not self.since or started >= self.since)
            and (not self.until or (started != "" and started[: len(self.until)] <= self.until))
            and (not self.rig or entry.rig_name == self.rig or entry.rig_sha256.startswith(self.rig))
            and (not self.verdict or run.verdict == self.verdict)
            and (not self.text or any(self.text.lower() in text.lower() for text in _texts(run)))
        )


def _texts(run: Run) -> Iterator[str]:
    entry = run.entry
    yield from (entry.experiment, entry.recording.name, entry.outcome, entry.software_version, entry.rig_text)
    yield from (note.text for note in run.notes)
    yield from (each.document for each in run.attachments)


@dataclass(frozen=True, slots=True)
class _Files:
    """Numbers of the notes and results of a run, in their order."""

    notes: list[int]
    results: list[int]


class RunStore:
    """The runs of one folder; a context manager, which makes it. What a call has written is kept when it returns."""

    def __init__(self, folder: Path | str) -> None:
        self.folder = Path(folder)
        self.path = store_of(self.folder)

    def __enter__(self) -> Self:
        if not self.folder.is_dir():
            raise StoreError(self.path, f"expected an existing folder, got {self.folder}. Make it first.")
        with self._in_words():
            self.path.mkdir(exist_ok=True)
        if not is_inside(self.folder, self.path):
            raise StoreError(self.path, "expected a folder, got a link to somewhere else. Move it away.")
        return self

    def __exit__(self, *_: object) -> None: ...

    def add_run(self, entry: RunEntry) -> int:
        """Enter a run; one that is there already, the same file with the same data, keeps its number."""
        card, listed = self._card(entry), self._listed()
        for number in listed:
            try:
                known = self._content(self._run_path(number), _RUN)
            except ValueError:
                continue
            if known is not None and (str(known.recording), known.data_sha256) == (
                card["recording"],
                entry.data_sha256,
            ):
                return number
        return self._first_free(lambda number: self._run_path(number), max(listed, default=0) + 1, "run", card)

    def attach(self, run_id: int, kind: str, content: Path | str | Mapping[str, Any]) -> None:
        """Add something that came of a run."""
        path = Path(self._relative(content)) if isinstance(content, Path) else None
        found = attachment_of(kind, _now_utc(), path, _document(content))
        files = self._require(run_id)
        with self._in_words():
            number = max(files.results, default=0) + 1
            while True:
                try:
                    write_whole(
                        self._document_path(run_id, number), found.document.encode("utf-8", "replace"), new=True
                    )
                    break
                except FileExistsError:  # another program's, or of one that was killed before it had written the rest
                    number += 1
        head = _RESULT.dump_python(replace(found, document=""), mode="json")
        self._first_free(lambda _: self._path(run_id, "result", number), number, "result", head)

    def note(self, run_id: int, text: str) -> None:
        """Add an operator's note to a run."""
        if not text.strip():
            raise UsageError("expected a note, got an empty one")
        text = text.encode("utf-8", "replace").decode()
        first = max(self._require(run_id).notes, default=0) + 1
        self._first_free(
            lambda number: self._path(run_id, "note", number), first, "note", _NOTE.dump_python(Note(_now_utc(), text))
        )

    def move(self, run_id: int, entry: RunEntry) -> None:
        """Tell where the recording of a run is now, and what it says of itself."""
        self._require(run_id)
        with self._in_words():
            write_whole(self._run_path(run_id), _text("run", self._card(entry)))

    def find(self, wanted: RunFilter | None = None) -> list[Run]:
        """Return the runs that are asked for, all without a filter, oldest first; attachments without documents."""
        asked = wanted or RunFilter()
        listed = self._listed().items()
        runs = [run for number, files in listed if (run := self._read(number, files, bool(asked.text))) is not None]
        taken = [run for run in runs if asked.takes(run)]
        taken.sort(key=lambda run: (run.entry.started_utc, run.run_id))
        if asked.text:
            return [replace(run, attachments=tuple(replace(a, document="") for a in run.attachments)) for run in taken]
        return taken

    def get(self, run_id: int) -> Run:
        """Return a run with the documents of its attachments; `UsageError` where there is none of the number."""
        files = self._listed().get(run_id)
        run = None if files is None else self._read(run_id, files, True)
        if run is None:
            raise UsageError(f"{self.path}: expected the number of a run, got {run_id}, which is none. See: hil runs")
        return run

    def delete(self, run_id: int) -> Run:
        """Take a run out, with its notes and attachments; no recording is touched."""
        run, files = self.get(run_id), self._listed()[run_id]
        with self._in_words():
            write_whole(self._run_path(run_id), _text("run", None))
            for what, numbers in (("note", files.notes), ("result", files.results)):
                for number in numbers:
                    self._path(run_id, what, number).unlink(missing_ok=True)
                    self._document_path(run_id, number).unlink(missing_ok=True)
        return run

    def _is_here(self, name: Path) -> bool:
        """Whether a name is that of a file in the folder; a plain one that is no link needs no further look."""
        path = self.folder / name
        if len(name.parts) == 1 and name.name not in ("", "..") and "\0" not in name.name:
            try:
                return not path.is_symlink() or is_inside(self.folder, path)
            except OSError:
                return False
        return is_inside(self.folder, path)

    def _listed(self) -> dict[int, _Files]:
        """Return which numbers are given, deleted ones too, with what is kept of each."""
        found: dict[int, _Files] = {}
        with self._in_words():
            names = sorted(entry.name for entry in self.path.iterdir())
        for match in filter(None, map(_NAME.fullmatch, names)):
            files = found.setdefault(int(match["run"]), _Files([], []))
            if match["what"]:
                (files.notes if match["what"] == "note" else files.results).append(int(match["number"]))
        for files in found.values():
            files.notes.sort()
            files.results.sort()
        return dict(sorted(found.items()))

    def _read(self, number: int, files: _Files, with_documents: bool) -> Run | None:
        """Read a run; None for one that was deleted."""
        try:
            entry = self._content(self._run_path(number), _RUN)
            if entry is None:
                return None
            if not self._is_here(entry.recording):
                raise ValueError("recording: expected the name of a file in the folder, got one that leads out of it")
            entry = replace(entry, recording=self.folder / entry.recording)
        except ValueError as error:
            cure = f"'hil runs rebuild --store {self.folder}' enters its recording anew"
            entry = RunEntry(recording=self.folder / "(unknown)", outcome=f"{DAMAGED} ({error}). {cure}")
        notes = tuple(self._note(self._path(number, "note", each)) for each in files.notes)
        return Run(number, entry, notes, tuple(self._result(number, each, with_documents) for each in files.results))

    def _note(self, path: Path) -> Note:
        try:
            return self._content(path, _NOTE) or Note("", "")
        except ValueError as error:
            return Note("", f"{DAMAGED}: {path.name}: {error}")

    def _result(self, run_id: int, number: int, with_document: bool) -> Attachment:
        path = self._path(run_id, "result", number)
        try:
            found = self._content(path, _RESULT)
        except ValueError as error:
            return Attachment(f"{DAMAGED}: {path.name}: {error}", "")
        if found is None:
            return Attachment(f"{DAMAGED}: {path.name}", "")
        where = None if found.path is None else self.folder / found.path
        document = _read_text(self._document_path(run_id, number)) if with_document else ""
        return replace(found, path=where, document=document) if where or document else found

    def _content(self, path: Path, kind: TypeAdapter[T]) -> T | None:
        """Read a file; None for a run that was deleted."""
        try:
            document = read_json(path)
        except OSError as error:
            raise ValueError(f"expected a file that can be read, got: {error.strerror or error}") from error
        what = _what(path)
        if not isinstance(document, dict) or document.get("schema") != SCHEMA or what not in document:
            raise ValueError(f"expected {SCHEMA} with {what}, got something else")
        content = document[what]
        try:
            return None if content is None and what == "run" else kind.validate_python(content)
        except ValidationError as error:
            raise ValueError(", ".join(".".join(map(str, each["loc"])) for each in error.errors())) from error

    def _first_free(self, path: Callable[[int], Path], number: int, what: str, content: Any) -> int:
        """Write a file under the first number that no other program has taken by then."""
        with self._in_words():
            while True:
                try:
                    write_whole(path(number), _text(what, content), new=True)
                    return number
                except FileExistsError:
                    number += 1

    def _run_path(self, run_id: int) -> Path:
        return self.path / f"{run_id}.json"

    def _path(self, run_id: int, what: str, number: int) -> Path:
        return self.path / f"{run_id}.{what}_{number}.json"

    def _document_path(self, run_id: int, number: int) -> Path:
        return self.path / f"{run_id}.result_{number}.document"

    def _require(self, run_id: int) -> _Files:
        self.get(run_id)
        return self._listed()[run_id]

    def _card(self, entry: RunEntry) -> dict[str, Any]:
        """Return an entry as it is written: its recording relative to the folder, for both may be moved together."""
        resolved = entry.recording.resolve()
        if not resolved.is_relative_to(self.folder.resolve()):
            raise StoreError(
                self.path,
                f"expected a recording inside {self.folder}, got {entry.recording}. Use the store of its folder.",
            )
        card: dict[str, Any] = _RUN.dump_python(entry, mode="json")
        return {**card, "recording": resolved.relative_to(self.folder.resolve()).as_posix()}

    def _relative(self, path: Path) -> str:
        resolved, home = path.resolve(), self.folder.resolve()
        return resolved.relative_to(home).as_posix() if resolved.is_relative_to(home) else str(resolved)

    @contextmanager
    def _in_words(self) -> Iterator[None]:
        try:
            yield
        except FileExistsError:
            if not self.path.is_dir():
                raise StoreError(self.path, "expected a folder, got a file of that name. Move it away.") from None
            raise
        except OSError as error:
            raise StoreError(
                self.path,
                f"expected a folder that can be read and has room, got: {error.strerror or error}. Nothing of it was "
                "entered; make room, or fix the permissions, and try again.",
            ) from error


def _what(path: Path) -> str:
    match = _NAME.fullmatch(path.name)
    return (match and match["what"]) or "run"


def _text(what: str, content: Any) -> str:
    return json.dumps({"schema": SCHEMA, what: content}, allow_nan=False) + "\n"


def _read_text(path: Path) -> str:
    """Return a kept document; empty where it is gone, or no longer what is kept here."""
    try:
        if path.is_file() and path.stat().st_size <= LONGEST_DOCUMENT_BYTES:
            return read_regular_text(path, errors="replace")
    except OSError:
        pass
    return ""


def _document(content: Path | str | Mapping[str, Any]) -> str:
    if isinstance(content, str):
        return content
    if isinstance(content, Mapping):
        return json.dumps(content, ensure_ascii=False)
    try:
        raw = read_regular(content)
    except OSError as error:
        raise UsageError(f"{content}: expected a file to attach, got: {error.strerror or error}") from error
    try:
        return raw.decode("utf-8") if len(raw) <= LONGEST_DOCUMENT_BYTES else ""
    except UnicodeDecodeError:
        return ""  # not text: known by its name


def _now_utc() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
