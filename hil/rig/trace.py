"""Every frame of a run's bus, recorded next to its samples by python-can's own writers.

The cycle only puts a frame into a queue; a thread of its own writes, twenty times a second. The times are those of
the samples: the host's monotonic clock, stamped once, shifted to the time of day at which the trace began.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from pathlib import Path
from types import TracebackType
from typing import Self

from drivers.canopen import can
from hil.errors import RecordingError
from hil.recording.bounds import no_room

SUFFIXES = (".blf", ".log", ".asc")
"""Vector's binary and text logs, and the text of Linux's candump: what ``can.Logger`` writes by these names."""

READABLE = (*SUFFIXES, ".trc")
"""What can be read: PEAK's text log too, whose times are whole microseconds at best."""

WRITE_EVERY_S = 0.05

MOST_WAITING = 200_000
"""Frames that may wait for the disk: over a minute of a full bus at 500 kbit/s."""

NS_PER_S = 1_000_000_000


class BusTrace:
    """A trace file, from `__enter__` to `__exit__`.

    Parameters
    ----------
    path
        A new file; its suffix, one of `SUFFIXES`, chooses the format.

    Raises
    ------
    RecordingError
        On entry, if the name can't be used; on exit, if the disk did not take the frames.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.n_frames = 0
        self._frames: deque[tuple[can.Message, int]] = deque()
        self._ending = threading.Event()
        self._failed: OSError | None = None
        self._thread = threading.Thread(target=self._write_on, name="bus trace", daemon=True)
        self._shift_ns = time.time_ns() - time.monotonic_ns()

    def __enter__(self) -> Self:
        require_trace_name(self.path)
        if self.path.exists():
            raise RecordingError(self.path, "expected a new name, got one that exists: a trace is never overwritten.")
        try:
            self._writer = can.Logger(self.path)
        except OSError as error:
            raise RecordingError(self.path, f"expected a place to write, got: {error.strerror or error}") from error
        self._thread.start()
        return self

    def take(self, message: can.Message, t_ns: int) -> None:
        """Take one frame, sent or received at ``t_ns`` of the monotonic clock; it belongs to the trace from now on."""
        if len(self._frames) < MOST_WAITING:
            self._frames.append((message, t_ns))
        elif self._failed is None:
            self._failed = OSError(f"{MOST_WAITING} frames wait for the disk")

    def raise_if_failed(self) -> None:
        """Tell that the disk does not take the frames."""
        if self._failed is not None:
            raise no_room(self.path, "the bus trace", self._failed, "Make room and run again.") from self._failed

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ending.set()
        self._thread.join()
        try:
            self._writer.stop()
        except OSError as cause:
            self._failed = self._failed or cause
        if error is None:  # what ended the run matters more than its trace
            self.raise_if_failed()

    def _write_on(self) -> None:
        try:
            while not self._ending.wait(WRITE_EVERY_S):
                self._write_all()
            self._write_all()
        except OSError as error:
            self._failed = error
            self._frames = deque(maxlen=0)  # keeps nothing any more

    def _write_all(self) -> None:
        while self._frames:
            message, t_ns = self._frames.popleft()
            message.timestamp = (t_ns + self._shift_ns) / NS_PER_S
            message.channel = None  # one bus: its name here is this program's own affair
            self._writer.on_message_received(message)
            self.n_frames += 1


def is_trace(path: Path) -> bool:
    """Tell a bus trace from a recording, by its suffix."""
    return path.suffix.lower() in READABLE


def require_trace_name(path: Path) -> None:
    """Refuse a name no trace that is written can have."""
    if path.suffix.lower() not in SUFFIXES:
        raise RecordingError(path, f"expected a name that ends in one of {', '.join(SUFFIXES)}, got {path.suffix!r}")
