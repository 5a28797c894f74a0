"""Where the view's reports come from: a rig in a process of its own, or a recording (`replay_source`)."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Sequence
from multiprocessing.connection import wait
from types import TracebackType
from typing import Protocol, Self

from hil.child import safe_path
from hil.monitor.host import Job, serve
from hil.monitor.messages import Ended, Order, Quit, Report

LONGEST_END_S = 30.0
"""Time for the rig's process to end [s]: every wait in it is bounded, and disarming two dead drives takes seconds."""

HARD_END = (
    "the rig's process ended without saying that the drives are disarmed. They stop by themselves when the host's "
    "heartbeat is gone; see that they did (hil check), before anyone goes near the shaft."
)


class Source(Protocol):
    """What the view watches; a context manager."""

    @property
    def can_drive(self) -> bool:
        """Whether there is a rig that takes orders."""
        ...

    def poll(self) -> Sequence[Report]:
        """Give what has come since the last call; never waits."""
        ...

    def send(self, order: Order) -> None:
        """Give an order; nothing happens where nothing can take it."""
        ...

    def await_end(self) -> None:
        """Return once nothing can drive any more, at the latest after `LONGEST_END_S`; from any thread."""
        ...

    def __enter__(self) -> Self:
        """Begin."""
        ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End it; where there is a rig, at zero torque and with its drives disarmed."""
        ...


class RigSource:
    """A rig in a process of its own, from `__enter__` to `__exit__`.

    The rig's process is never killed from here: it is what takes the torque away.

    Parameters
    ----------
    job
        What the process is for.
    """

    can_drive = True

    def __init__(self, job: Job) -> None:
        context = multiprocessing.get_context("spawn")  # a fork would share this program's terminal and threads
        self._connection, self._far_end = context.Pipe()
        self._process = context.Process(target=serve, args=(job, self._far_end), name="hil rig")
        self._ended = False
        self._last_words: list[Report] = []

    def __enter__(self) -> Self:
        with safe_path():
            self._process.start()
        self._far_end.close()  # or its process's end would not be seen here
        return self

    @property
    def pid(self) -> int | None:
        """Of the rig's process."""
        return self._process.pid

    def poll(self) -> Sequence[Report]:
        """Give what has come; `Ended` last, also where the process ended without a word."""
        reports, self._last_words = self._last_words, []
        while not self._ended:
            try:
                if not self._connection.poll():
                    break
                report: Report = self._connection.recv()
            except (EOFError, OSError):
                report = Ended(HARD_END)
            self._ended = isinstance(report, Ended)
            reports.append(report)
        return reports

    def send(self, order: Order) -> None:
        """Give an order; one that the process can't take any more is reported by `poll`."""
        if self._ended:
            return
        try:
            self._connection.send(order)
        except OSError:
            return

    def await_end(self) -> None:
        """Return once the rig's process has ended, at the latest after `LONGEST_END_S`; from any thread."""
        wait([self._process.sentinel], LONGEST_END_S)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.send(Quit())
        until = time.monotonic() + LONGEST_END_S
        while self._process.is_alive() and time.monotonic() < until:
            self._last_words = [*self.poll()]  # it may wait for room to tell its last
            self._process.join(0.02)
        self._last_words = [*self.poll()]
        if self._process.is_alive():
            self._last_words.append(Ended(f"after {LONGEST_END_S:g} s {HARD_END}"))
        self._connection.close()
