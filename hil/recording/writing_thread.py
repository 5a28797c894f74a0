"""Lines written by a thread of their own, so that whoever makes them waits for no disk."""

from __future__ import annotations

import threading
import time
from contextlib import suppress
from typing import Protocol

PAUSE_S = 0.002
"""After what was written [s]: lines that come faster, as those of a run without a clock, are written together."""


class Unbuffered(Protocol):
    """A file that hands to the system what it is given, and tells how much of it that has taken."""

    def write(self, data: bytes, /) -> int | None:
        """Write, perhaps only the first bytes."""

    def close(self) -> None:
        """Close it."""


class WritingThread:
    """Writes lines in their order, all that wait at once, from its making to `finish`.

    Parameters
    ----------
    file
        Where to; its maker closes it, unless `finish` gives up. Nothing is written after an OSError.
    capacity
        Lines that may wait, those that are being written included.
    """

    def __init__(self, file: Unbuffered, capacity: int) -> None:
        self._file = file
        self._capacity = capacity
        self._lines: list[str] = []
        self._in_hand = 0
        self._changed = threading.Condition()
        self._ending = self._given_up = False
        self.n_written = 0
        self.failed: OSError | None = None
        self._thread = threading.Thread(target=self._run, name="recording", daemon=True)
        self._thread.start()

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
