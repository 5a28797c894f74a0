"""Make the store again: from what can be read of it, and from the recordings, each of which explains itself."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from hil.errors import RecordingError
from hil.recording.formats import FORMATS, read_metadata
from hil.store.entry import RunEntry
from hil.store.register import entry_at, is_run
from hil.store.replace_damaged import replace_if_damaged
from hil.store.results import attach_results
from hil.store.run_store import RunStore


@dataclass(frozen=True, slots=True)
class Rebuilt:
    """What became of the store.

    Attributes
    ----------
    before : int
        Runs that were in it, or could be read of it.
    found : int
        Recordings that were entered now.
    moved : int
        Runs whose recording was found under another name.
    copies : int
        Recordings with the data of a run whose own is still there, such as conversions; they are no runs.
    attached : int
        Results (diagnosis.json, identification.json) that were attached now.
    unreadable : tuple of str
        What is wrong with recordings that could not be read.
    damaged : Path or None
        Where the damaged store was put; None where it was whole.
    lost_notes : tuple of str
        Notes to runs of which nothing else is left.
    """

    before: int
    found: int
    moved: int
    copies: int
    attached: int
    unreadable: tuple[str, ...]
    damaged: Path | None
    lost_notes: tuple[str, ...]


def rebuild(folder: Path, show: Callable[[Path], None] = lambda _: None) -> Rebuilt:
    """Bring the store of a folder up to what is in the folder; a damaged one is replaced and kept aside.

    Parameters
    ----------
    folder : Path
        It and the folders in it are looked through.
    show : callable
        Called with every recording before it is read.

    Raises
    ------
    StoreError
        If the store can't be written, or is of a newer version or another program's.
    """
    damaged = replace_if_damaged(folder)
    with RunStore(folder) as store:
        entering = _Entering(store, show)
        for path in recordings_in(folder):
            entering.take(path)
        attached = attach_results(store)
    return Rebuilt(
        entering.before,
        entering.found,
        entering.moved,
        entering.copies,
        attached,
        tuple(entering.unreadable),
        None if damaged is None else damaged.aside,
        () if damaged is None else damaged.lost_notes,
    )


class _Entering:
    """Enters recordings that are not in the store yet, and counts."""

    def __init__(self, store: RunStore, show: Callable[[Path], None]) -> None:
        known = store.find()
        self._store, self._show = store, show
        self._here = {(run.entry.recording.resolve(), run.entry.data_sha256) for run in known}
        self._data = {sha256 for _, sha256 in self._here if sha256}
        self._lost = {run.entry.data_sha256: run.run_id for run in known if not run.entry.recording.exists()}
        self.before = len(known)
        self.found = self.moved = self.copies = 0
        self.unreadable: list[str] = []

    def take(self, path: Path) -> None:
        self._show(path)
        try:
            if is_run(read_metadata(path)):
                self._enter(entry_at(path))
        except RecordingError as error:
            self.unreadable.append(str(error))

    def _enter(self, entry: RunEntry) -> None:
        sha256 = entry.data_sha256
        if (entry.recording.resolve(), sha256) in self._here:
            return
        if sha256 and sha256 in self._lost:
            self._store.move(self._lost.pop(sha256), entry.recording)
            self.moved += 1
        elif sha256 in self._data:
            self.copies += 1
        else:
            self._store.add_run(entry)
            self.found += 1
            self._data |= {sha256} - {""}


def recordings_in(folder: Path) -> Iterator[Path]:
    """Give every file of a recording's suffix in a folder and those in it, hidden ones and unfinished ones left out."""
    for path in sorted(folder.rglob("*")):
        inside = path.relative_to(folder).parts
        if path.suffix.lower() in FORMATS and path.is_file() and not any(part.startswith(".") for part in inside):
            yield path
