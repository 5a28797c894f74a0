"""A disk that stalls: whoever appends does not wait, nothing is lost, and what waits is bounded."""

from __future__ import annotations

import errno
import threading
from io import FileIO
from pathlib import Path

import pytest

from hil.errors import RecordingError
from hil.recording import RecordingWriter, read_table, writer
from hil.recording.writer import WritingThread
from tests.recording.test_writer import sample


class Disk:
    """A disk that stalls until it continues."""

    def __init__(self) -> None:
        self.continues = threading.Event()
        self.began = threading.Event()
        self.closed = threading.Event()


class StalledFile:
    """A file on it."""

    def __init__(self, file: FileIO, disk: Disk) -> None:
        self._file = file
        self._disk = disk

    def write(self, data: bytes) -> int:
        self._disk.began.set()
        assert self._disk.continues.wait(60.0)
        return self._file.write(data)

    def close(self) -> None:
        self._file.close()
        self._disk.closed.set()


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Disk:
    stalled = Disk()
    monkeypatch.setattr(
        writer, "WritingThread", lambda file, capacity: WritingThread(StalledFile(file, stalled), capacity)
    )
    return stalled


def test_who_appends_does_not_wait_and_nothing_is_lost(tmp_path: Path, disk: Disk) -> None:
    with RecordingWriter(tmp_path / "run.csv", patience_s=0.0) as recorder:
        for k in range(500):
            recorder.append(sample(k))  # the disk takes none of them: waiting for it would never end
        assert disk.began.wait(60.0)
        assert recorder.n_samples == 0
        disk.continues.set()
    assert recorder.n_samples == 500
    assert read_table(tmp_path / "run.csv").n_rows == 500


def test_when_too_many_wait_the_run_ends_and_keeps_them(
    tmp_path: Path, disk: Disk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writer, "CAPACITY", 20)
    appended = 0

    def run() -> None:
        nonlocal appended
        with RecordingWriter(tmp_path / "run.csv", patience_s=0.0) as recorder:
            try:
                for k in range(100):
                    recorder.append(sample(k))
                    appended += 1
                    assert disk.began.wait(60.0)
            finally:
                disk.continues.set()

    with pytest.raises(RecordingError, match="one for which 20 wait"):
        run()
    assert appended == 20
    assert read_table(tmp_path / "run.csv").n_rows == appended


def test_a_disk_that_hangs_for_good_does_not_hang_the_program(
    tmp_path: Path, disk: Disk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writer, "DRAIN_S", 0.01)
    with pytest.raises(RecordingError, match=r"the last \d+ samples within 0.01 s, got one that does not"):
        with RecordingWriter(tmp_path / "run.csv") as recorder:
            recorder.append(sample(0))
    disk.continues.set()
    assert disk.closed.wait(60.0)


class _SmallDisk:
    """A file on a disk with room for so many bytes, which takes what still fits."""

    def __init__(self, file: FileIO, room: int) -> None:
        self._file = file
        self._room = room

    def write(self, data: bytes) -> int:
        if not self._room:
            raise OSError(errno.ENOSPC, "No space left on device")
        taken = self._file.write(data[: self._room])
        self._room -= taken
        return taken

    def close(self) -> None:
        self._file.close()


@pytest.mark.parametrize("rows", [0, 1, 5])
def test_a_disk_that_takes_part_of_what_waits_keeps_the_rows_that_are_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rows: int
) -> None:
    recorder = RecordingWriter(tmp_path / "run.csv", patience_s=0.0)
    room = sum(len(recorder._row(sample(k))) for k in range(rows)) + 7
    monkeypatch.setattr(writer, "WritingThread", lambda file, capacity: WritingThread(_SmallDisk(file, room), capacity))

    def run() -> None:
        with recorder:
            for k in range(9):
                recorder.append(sample(k))

    with pytest.raises(RecordingError, match=f"expected room for sample {rows + 1}, got: No space left"):
        run()
    assert recorder.n_samples == rows
    assert (tmp_path / "run.csv").exists() == (rows > 0)
    assert not rows or read_table(tmp_path / "run.csv").n_rows == rows
