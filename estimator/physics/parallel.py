"""Simulations side by side on all cores, counted as work and held to a limit of time."""

from __future__ import annotations

import math
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from itertools import takewhile
from typing import TypeVar

PARTS = 4  # parts into which sums and lanes are cut where the cut shows in the last bits
THREADS_PER_CORE = 4  # threads that may exist: one works per core, the others wait for what they shared out


class TimeIsUp(Exception):
    """The limit of time of a computation has passed."""


class Work:
    """Samples that were simulated, and the moment at which no further ones are: after a share of the limit.

    Work inside other work shares its beginning.
    """

    def __init__(self, limit_s: float = math.inf, share: float = 1.0) -> None:
        self.samples = 0
        self.limit_s = limit_s
        outer = _work.get()
        self.began_s: float = time.perf_counter() if outer is None else outer.began_s
        self._end = self.began_s + share * limit_s
        self._lock = threading.Lock()

    def add(self, samples: int) -> None:
        """Count samples that are to be simulated."""
        self.check()
        with self._lock:
            self.samples += samples

    def check(self) -> None:
        """Raise ``TimeIsUp`` where nothing further is to be begun."""
        if time.perf_counter() > self._end:
            raise TimeIsUp

    @property
    def left_s(self) -> float:
        """Time until the whole limit [s]; negative where it has passed."""
        return self.began_s + self.limit_s - time.perf_counter()


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
    """Add simulated samples to the work of the present diagnosis."""
    work = _work.get()
    if work is not None:
        work.add(samples)


def time_left_s() -> float:
    """Return the time until the whole limit [s], for what is done outside this process; infinity without one."""
    work = _work.get()
    return math.inf if work is None else work.left_s


def check_time() -> None:
    """Raise ``TimeIsUp`` where a limit of time has passed: for work that is no simulation."""
    work = _work.get()
    if work is not None:
        work.check()


Item = TypeVar("Item")
Result = TypeVar("Result")


def available_cores() -> int:
    """Return how many cores this process may use."""
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return allowed or 1


class _Cores:
    """The cores that work, and who of them is idle."""

    def __init__(self, count: int) -> None:
        self.count = count
        self.idle = threading.Semaphore(count - 1)
        self.pool = ThreadPoolExecutor(THREADS_PER_CORE * count, thread_name_prefix="driveline")

    def taken(self, most: int) -> int:
        """Take idle cores, as many as there are and no more than wanted; return how many."""
        return sum(1 for _ in takewhile(lambda _: self.idle.acquire(blocking=False), range(most)))


_cores = _Cores(available_cores())


def workers() -> int:
    """Return on how many cores is worked."""
    return _cores.count


def work_on(cores: int) -> None:
    """Work on so many cores from the next call on; what is under way continues as it began."""
    global _cores
    if cores < 1:
        raise ValueError(f"cores: expected 1 or more, got {cores}")
    _cores = _Cores(cores)


def concurrently(function: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """Return ``function`` of each item, in order; the first error ends the rest."""
    cores, todo, results = _cores, deque(enumerate(items)), dict[int, Result]()
    helpers: list[Future[None]] = []

    def help_out() -> None:
        try:
            work(recruit=False)
        finally:
            cores.idle.release()

    def work(recruit: bool) -> None:
        while todo:
            try:
                i, item = todo.popleft()
            except IndexError:  # another core took the last one
                return
            if recruit:
                helpers.extend(cores.pool.submit(copy_context().run, help_out) for _ in range(cores.taken(len(todo))))
            try:
                results[i] = function(item)
            except BaseException:
                todo.clear()
                raise

    try:
        work(recruit=True)
    finally:
        _wait_for(helpers, cores)
    for helper in helpers:
        helper.result()
    return [results[i] for i in range(len(items))]


def _wait_for(helpers: Sequence[Future[None]], cores: _Cores) -> None:
    if all(helper.done() for helper in helpers):
        return
    cores.idle.release()
    try:
        for helper in helpers:
            helper.exception()
    finally:
        cores.idle.acquire()
