"""Lines written by a thread of their own, so that whoever makes them waits for no disk."""

from __future__ import annotations

import queue
import threading
from contextlib import suppress
from typing import TextIO


class WritingThread:
    """Writes lines in their order, from its making to `finish`.

    Parameters
    ----------
    file
        Where to; its maker closes it, unless `finish` gives up. Nothing is written after an OSError.
    capacity
        Lines that may wait.
    """

    def __init__(self, file: TextIO, capacity: int) -> None:
        self._file = file
        self._lines: queue.Queue[str | None] = queue.Queue(capacity)
        self._given_up = False
        self.n_written = 0
        self.failed: OSError | None = None
        self._thread = threading.Thread(target=self._run, name="recording", daemon=True)
        self._thread.start()

    @property
    def n_waiting(self) -> int:
        """Lines that wait for the disk."""
        return self._lines.qsize()

    def put(self, line: str, patience_s: float) -> bool:
        """Hand over one line; False if there is no room for it within a time [s]."""
        try:
            self._lines.put(line, timeout=patience_s) if patience_s > 0.0 else self._lines.put_nowait(line)
        except queue.Full:
            return False
        return True

    def finish(self, patience_s: float) -> bool:
        """End the thread when everything is written; False if that takes longer than a time [s]: it is given up."""
        try:
            self._lines.put(None, timeout=patience_s)
            self._thread.join(patience_s)
        except queue.Full:
            pass
        self._given_up = self._thread.is_alive()
        return not self._given_up

    def _run(self) -> None:
        while not self._given_up and (line := self._lines.get()) is not None:
            if self.failed is None:
                self._take(line)
        if self._given_up:
            with suppress(OSError):
                self._file.close()

    def _take(self, line: str) -> None:
        try:
            self._file.write(line)
        except OSError as error:
            self.failed = error
        else:
            self.n_written += 1
