"""Work of a computation: its simulations are counted, and a limit of time ends it between two of them.

The count is the same on every machine; the limit is not, and whoever sets one catches ``TimeIsUp``.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar


class TimeIsUp(Exception):
    """The limit of time of a computation has passed."""


class Work:
    """Samples that were simulated, and the moment at which no further ones are."""

    def __init__(self, limit_s: float = math.inf, share: float = 1.0) -> None:
        self.samples = 0
        self.limit_s = limit_s
        self._end = time.perf_counter() + share * limit_s
        self._lock = threading.Lock()

    def add(self, samples: int) -> None:
        """Count samples that are to be simulated."""
        self.check()
        with self._lock:
            self.samples += samples

    def check(self) -> None:
        """Raise ``TimeIsUp`` where the limit has passed."""
        if self.left_s < 0.0:
            raise TimeIsUp

    @property
    def left_s(self) -> float:
        """Time until the limit [s]; negative where it has passed."""
        return self._end - time.perf_counter()


_work: ContextVar[Work | None] = ContextVar("work", default=None)


@contextmanager
def counted(work: Work) -> Iterator[Work]:
    """Count what is simulated in this context, and in what it shares out to other cores."""
    token = _work.set(work)
    try:
        yield work
    finally:
        _work.reset(token)


def count_samples(samples: int) -> None:
    """Count samples that are to be simulated, where somebody counts."""
    work = _work.get()
    if work is not None:
        work.add(samples)


def time_left_s() -> float:
    """Return the time until the limit [s], for what is done outside this process; infinity without one."""
    work = _work.get()
    return math.inf if work is None else work.left_s


def check_time() -> None:
    """Raise ``TimeIsUp`` where a limit of time has passed: for work that is no simulation."""
    work = _work.get()
    if work is not None:
        work.check()
