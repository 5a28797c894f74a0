"""Work on both cores: the compiled kernel holds no interpreter lock, so threads are enough."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

WORKERS = 2

Item = TypeVar("Item")
Result = TypeVar("Result")

_here = threading.local()


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(WORKERS, thread_name_prefix="driveline")


def concurrently(function: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """Return ``function`` of each item, in order; calls inside such a call run one after the other."""
    if len(items) < 2 or getattr(_here, "working", False):
        return [function(item) for item in items]

    def work(item: Item) -> Result:
        _here.working = True
        return function(item)

    return list(_pool().map(work, items))
