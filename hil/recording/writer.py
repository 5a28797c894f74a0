"""A recording as it is made: every sample leaves the program at once, the file gets its name when whole.

While the run continues, rows stand in ``<stem>.part.csv`` next to the target, described by ``<stem>.part.csv.json``
before the first of them comes; one line each, handed to the operating system by a thread of its own: whoever appends
waits for no disk. What the disk has not taken
yet waits in memory, `CAPACITY` samples at most. When the run ends, in any way Python can still act on (end, error,
Ctrl-C), the rows become the recording, in its own format. What a harder end leaves:

- killed process: the part file with every sample the disk has taken; it is a recording itself and can be read as it is;
- power failure: the part file without what the operating system had not yet written (on Linux up to about
  30 s), perhaps with a torn last line, which readers refuse by its number.

Parquet could not do that itself: without its footer, written last, it can't be read at all.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterable, Mapping
from contextlib import suppress
from io import FileIO
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from drivers.foreign_file import open_regular
from hil.errors import RecordingError
from hil.files import remove_abandoned
from hil.recording import columns
from hil.recording.bounds import no_room
from hil.recording.description import OUTCOME, Sidecar, as_metadata, sidecar_of, write_sidecar
from hil.recording.formats import read_table, writer_for
from hil.recording.own_csv import own_sidecar
from hil.recording.publish import write_table
from hil.recording.table import Table
from hil.sample import Sample

PAUSE_S = 0.002
"""After what was written [s]: lines that come faster, as those of a run without a clock, are written together."""

CSV, PART = ".csv", ".part.csv"

CAPACITY = 20_000  # samples that may wait for the disk: 200 s at 10 ms, some 10 MB
DRAIN_S = 60.0  # time the disk has for them when the run is over [s]
FIRST_WRITE_S = 10.0  # time it has for the first bytes [s]

NOT_ENDED = "did not reach its end: the program was killed, or the disk was full"
"""What a recording says of its outcome until it has one."""

LONGEST_ROW = 1 << 16  # bytes; the disk tore at most one row


def cells_of(sample: Sample) -> tuple[float | int, ...]:
    """Return one sample in the order of ``columns.UNITS``, then its channels; the flags alone are an integer."""
    return (
        float(sample.time_s),
        float(sample.torque_ref_nm),
        float(sample.torque_m1_nm),
        float(sample.torque_m2_nm),
        float(sample.speed_rad_s),
        float(sample.prbs_nm),
        int(sample.flags),
        float(sample.torque_ref_m1_nm),
        float(sample.torque_ref_m2_nm),
        sample.age_ns / 1e9,
        *map(float, sample.channels),
    )


def table_of(
    samples: Iterable[Sample], path: Path, metadata: Mapping[str, str], channel_units: Mapping[str, str] | None = None
) -> Table:
    """Make a table of samples, a row each, with a column of each channel of theirs."""
    rows = [cells_of(sample) for sample in samples]
    units = {**columns.UNITS, **(channel_units or {})}
    kinds = {name: np.int64 if name == columns.FLAGS else np.float64 for name in units}
    cells = zip(*rows, strict=True) if rows else [() for _ in kinds]
    return Table(
        path,
        {name: np.array(column, dtype=kind) for (name, kind), column in zip(kinds.items(), cells, strict=True)},
        units,
        metadata,
    )


class WritingThread:
    """Writes lines in their order, all that wait at once, from its making to `finish`."""

    def __init__(self, file: FileIO, capacity: int) -> None:
        self._file = file
        self._capacity = capacity
        self._lines: list[str] = []
        self._in_hand = 0
        self._changed = threading.Condition()
        self._ending = self._given_up = False
        self.n_written = 0
        self._first_s: float | None = None
        self.failed: OSError | None = None
        self._thread = threading.Thread(target=self._run, name="recording", daemon=True)
        self._thread.start()

    @property
    def first_waits_s(self) -> float:
        """How long the first line has waited for the disk [s]; 0 once that has taken it."""
        return 0.0 if self.n_written or self._first_s is None else time.monotonic() - self._first_s

    @property
    def n_waiting(self) -> int:
        """Lines that wait for the disk."""
        return len(self._lines) + self._in_hand

    def put(self, line: str, patience_s: float) -> bool:
        """Hand over one line; False if there is no room for it within a time [s]."""
        with self._changed:
            if not self._changed.wait_for(lambda: self.n_waiting < self._capacity, patience_s):
                return False
            self._lines.append(line)
            self._first_s = self._first_s or time.monotonic()
            if len(self._lines) == 1:
                self._changed.notify_all()
        return True

    def finish(self, patience_s: float) -> bool:
        """End the thread when everything is written; False if that takes longer than a time [s]: it is given up."""
        with self._changed:
            self._ending = True
            self._changed.notify_all()
        self._thread.join(patience_s)
        self._given_up = self._thread.is_alive()
        return not self._given_up

    def _run(self) -> None:
        while lines := self._next():
            if self.failed is None:
                self._write("".join(lines).encode("ascii"))
            if self._given_up:
                break
            time.sleep(PAUSE_S)
        if self._given_up:
            with suppress(OSError):
                self._file.close()

    def _next(self) -> list[str]:
        """Wait for lines; none when all are written and no more will come."""
        with self._changed:
            self._in_hand = 0
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._lines or self._ending)
            lines, self._lines = self._lines, []
            self._in_hand = len(lines)
        return lines

    def _write(self, data: bytes) -> None:
        try:
            while data:
                taken = self._file.write(data) or 0
                self.n_written += data.count(b"\n", 0, taken)
                data = data[taken:]
        except OSError as error:
            self.failed = error


def hold(file: FileIO | int) -> bool:
    """Hold a file for this process, and tell whether that could be; where the system can't, nobody can tell."""
    try:
        import fcntl
    except ImportError:
        return False
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


class RecordingWriter:
    """Write the samples of one run; a context manager.

    A run without a sample leaves no file.

    Parameters
    ----------
    path : Path or str
        The recording to make; its suffix chooses the format.
    metadata : mapping of str to str
        What the recording shall say of itself; more can be said until it is closed, by `describe`. CSV has no
        place for it: there it is in a file next to the recording (`hil.recording.description`).
    channel_units : mapping of str to str
        Column and unit of each channel of its samples.
    patience_s : float
        How long `append` may wait for room where `CAPACITY` samples wait already [s]: 0 in a run on the wall clock.

    Raises
    ------
    RecordingError
        On entry: if the name is taken, also by the part file of a run that was killed, or can't be written.
    """

    def __init__(
        self,
        path: Path | str,
        metadata: Mapping[str, str] | None = None,
        patience_s: float = DRAIN_S,
        channel_units: Mapping[str, str] | None = None,
    ) -> None:
        self.path = Path(path)
        self.part_path = self.path.with_name(f"{self.path.stem}{PART}")
        self._metadata = dict(metadata or {})
        self._units = {**columns.UNITS, **(channel_units or {})}
        self._file: FileIO | None = None
        self._patience_s = patience_s
        self._writing: WritingThread | None = None
        self._refused: BaseException | None = None
        self._given_up = False

    def __enter__(self) -> Self:
        opening = threading.Thread(target=self._open, name="opening", daemon=True)
        opening.start()
        opening.join(FIRST_WRITE_S)
        self._given_up = opening.is_alive()
        if self._given_up:
            raise self._too_slow()
        if self._refused is not None:
            raise self._refused
        if self._file is not None:
            self._writing = WritingThread(self._file, CAPACITY)
        return self

    def _too_slow(self) -> RecordingError:
        return RecordingError(
            self.path,
            f"expected a disk that takes the first bytes within {FIRST_WRITE_S:g} s, got one that does not. "
            "Choose another disk.",
        )

    def _open(self) -> None:
        """Make the part file, its description and its header, in a thread that may wait for the disk for ever."""
        try:
            self._make()
        except BaseException as error:  # noqa: BLE001 - it is raised where it is waited for
            self._refused = error
        if self._given_up and self._file is not None:
            self._file.close()
            self._remove_part()

    def _make(self) -> None:
        writer_for(self.path)
        try:
            remove_abandoned(self.path.parent)
            self._file = self._opened()
        except FileExistsError as error:
            raise RecordingError(
                self.part_path,
                "expected no such file, got one left by a run that was killed, or that continues. "
                "It is a recording up to that moment: rename it and its .json to keep it, or remove it.",
            ) from error
        except OSError as error:
            raise RecordingError(
                self.path, f"expected a place to write, got: {error.strerror}. Choose another folder, or fix this one."
            ) from error
        try:
            said = as_metadata({**self._metadata, OUTCOME: NOT_ENDED})
            write_sidecar(self.part_path, Sidecar(said, self._units))
            self._begin(self._file)
        except (OSError, RecordingError) as error:
            self._file.close()
            self._file = None
            self._remove_part()
            cause = error.__cause__ if isinstance(error, RecordingError) else error
            raise no_room(self.path, "the recording", cause if isinstance(cause, OSError) else OSError()) from error

    def _remove_part(self) -> None:
        self.part_path.unlink(missing_ok=True)
        sidecar_of(self.part_path).unlink(missing_ok=True)

    def _opened(self) -> FileIO:
        """Open the part file, a new one or one that a run has left which was killed before its first sample.

        Unbuffered: what the thread writes reaches the operating system at once. It is held while the run lasts.
        """
        try:
            file = self.part_path.open("xb", buffering=0)
        except FileExistsError:
            file = self.part_path.open("rb+", buffering=0)
            if not (hold(file) and self._header.startswith(file.read(len(self._header) + 1))):
                file.close()
                raise
            file.seek(0)
            file.truncate()
            return file
        hold(file)
        return file

    @property
    def _header(self) -> bytes:
        return (",".join(self._units) + "\n").encode()

    def _begin(self, file: FileIO) -> None:
        header = self._header
        while header:  # a disk that has too little room takes a part first
            header = header[file.write(header) :]

    @property
    def written_file(self) -> Path | None:
        """The file that holds what was appended, once the writer is closed; None where nothing was."""
        return next((path for path in (self.path, self.part_path) if self.n_samples and path.exists()), None)

    def describe(self, key: str, value: str) -> None:
        """Have the recording say one thing more of itself, such as how the run went."""
        self._metadata[key] = value

    @property
    def n_samples(self) -> int:
        """Samples the disk has taken."""
        return 0 if self._writing is None else self._writing.n_written

    def append(self, sample: Sample) -> None:
        """Hand over one sample to be written; waits for no disk.

        Raises
        ------
        RecordingError
            If the writer is not open, or the disk has not taken a sample before this one, or too many wait for it.
        """
        if self._file is None or self._writing is None:
            raise RecordingError(self.path, "expected an open writer, got one that is closed. Use it by 'with'.")
        self._raise_if_failed(self._writing)
        if self._writing.first_waits_s > FIRST_WRITE_S:
            raise self._too_slow()
        if not self._writing.put(self._row(sample), self._patience_s):
            raise RecordingError(
                self.path,
                f"expected a disk that takes samples as they come, got one for which {CAPACITY} wait. They are kept "
                "if it takes them now; choose another disk.",
            )

    def _raise_if_failed(self, writing: WritingThread) -> None:
        if writing.failed is not None:
            what, then = f"sample {writing.n_written + 1}", "Those before it are kept; make room and run again."
            raise no_room(self.path, what, writing.failed, then) from writing.failed

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Make the recording of what has been appended, however the run ended."""
        if self._file is None:
            return
        if error is not None:
            self.describe(
                OUTCOME, "interrupted" if isinstance(error, KeyboardInterrupt) else str(error) or type(error).__name__
            )
        file, self._file = self._file, None
        try:
            lost = self._closed(file)
            if self.n_samples == 0:
                self._remove_part()
            else:
                self._publish()
            if lost is not None:
                raise lost
        except RecordingError as failure:
            if error is None:
                raise
            error.add_note(str(failure))  # what ended the run comes first

    def _closed(self, file: FileIO) -> RecordingError | None:
        """Have the disk take what waits, and close the file; give what keeps the recording from being whole."""
        writing = self._writing
        if writing is None:
            return None
        drained = writing.finish(DRAIN_S if writing.first_waits_s <= FIRST_WRITE_S else 0.0)
        if not drained:
            raise RecordingError(
                self.path,
                f"expected a disk that takes the last {writing.n_waiting} samples within {DRAIN_S:g} s, got one that "
                "does not: they are lost. Choose another disk.",
            )
        file.close()
        if writing.failed is None:
            return None
        self._cut_torn_line()
        try:
            self._raise_if_failed(writing)
        except RecordingError as failure:
            return failure
        return None

    def _cut_torn_line(self) -> None:
        with self.part_path.open("rb+") as file:
            begin = max(file.seek(0, os.SEEK_END) - LONGEST_ROW, 0)
            file.seek(begin)
            file.truncate(begin + file.read().rfind(b"\n") + 1)

    def _publish(self) -> None:
        if self.path.suffix.lower() == CSV:  # the part file is the recording: it only gets its name
            writer_for(self.path)
            said = own_sidecar(self.part_path, self._metadata, self._units)
            try:
                write_sidecar(self.path, said)
            except RecordingError:  # the description from before the first row needs no room
                sidecar_of(self.part_path).replace(sidecar_of(self.path))
                raise
            finally:
                self.part_path.rename(self.path)
            self._remove_part()
            return
        table = Table(self.path, read_table(self.part_path).columns, self._units, self._metadata)
        try:
            write_table(table, self.path)
        except RecordingError as error:
            kept = f"Its samples are in {self.part_path}, a recording itself: rename it and its .json to keep it."
            *others, last = error.problems
            raise RecordingError(self.path, *others, f"{last} {kept}") from error
        self._remove_part()

    def _row(self, sample: Sample) -> str:
        """Format one row in the order of the header; a float as the shortest decimal that reads back to it."""
        cells = cells_of(sample)
        if len(cells) != len(self._units):
            raise RecordingError(
                self.path,
                f"expected samples with {len(self._units)} cells, one for each of {', '.join(self._units)}, got one "
                f"with {len(cells)}. Give the channels of the rig file that the samples are of.",
            )
        return ",".join(map(repr, cells)) + "\n"


def is_written(path: Path) -> bool:
    """Whether a run writes a file at this moment; where the system can't tell, it does not."""
    if not path.name.endswith(PART):
        return False
    with open_regular(path) as file:
        return not hold(file.fileno())
