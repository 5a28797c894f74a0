"""Work on both cores: the compiled kernel holds no interpreter lock, so threads are enough.

Whoever calls works itself and lets idle cores help. Calls inside such a call do the same: when one long piece of work
is left, what is inside it is shared out.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache
from typing import TypeVar

WORKERS = 2
DEEPEST = 8
"""Threads that may exist: one works per core, the others wait for what they shared out."""

Item = TypeVar("Item")
Result = TypeVar("Result")

_idle_cores = threading.Semaphore(WORKERS - 1)


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(DEEPEST, thread_name_prefix="driveline")


def in_turn(function: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """Do the same one after the other: each item has all the room, and both cores for what is shared out inside."""
    return [function(item) for item in items]


def concurrently(function: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """Return ``function`` of each item, in order; the first error ends the rest."""
    todo, results = deque(enumerate(items)), dict[int, Result]()
    helpers: list[Future[None]] = []

    def help_out() -> None:
        try:
            work(recruit=False)
        finally:
            _idle_cores.release()

    def work(recruit: bool) -> None:
        while todo:
            try:
                i, item = todo.popleft()
            except IndexError:  # the other core took the last one
                return
            if recruit and todo and _idle_cores.acquire(blocking=False):
                helpers.append(_pool().submit(help_out))
            try:
                results[i] = function(item)
            except BaseException:
                todo.clear()
                raise

    try:
        work(recruit=True)
    finally:
        _wait_for(helpers)
    for helper in helpers:
        helper.result()
    return [results[i] for i in range(len(items))]


def _wait_for(helpers: Sequence[Future[None]]) -> None:
    """Wait until helpers are done; whoever waits leaves its core to them."""
    if all(helper.done() for helper in helpers):
        return
    _idle_cores.release()
    try:
        for helper in helpers:
            helper.exception()
    finally:
        _idle_cores.acquire()
