"""Work on both cores: order, nesting and exceptions are those of a plain loop."""

from __future__ import annotations

import threading
import time

import pytest

from estimator.physics.parallel import WORKERS, concurrently


class Broken(Exception):
    """An item that can't be worked on."""


def test_results_come_in_the_order_of_the_items() -> None:
    """The first item can't end before the last has begun."""
    last_began = threading.Event()

    def work(item: int) -> int:
        if item == 0:
            assert last_began.wait(10.0)
        if item == 5:
            last_began.set()
        return item**2

    assert concurrently(work, range(6)) == [item**2 for item in range(6)]


def test_so_many_items_are_worked_on_at_once() -> None:
    """They wait for each other: one after the other would break the barrier."""
    meeting = threading.Barrier(WORKERS, timeout=10.0)
    concurrently(lambda _: meeting.wait(), range(WORKERS))
    assert not meeting.broken


def test_one_item_alone_stays_where_it_is() -> None:
    assert concurrently(lambda _: threading.get_ident(), [0]) == [threading.get_ident()]
    assert concurrently(lambda _: threading.get_ident(), []) == []


def test_calls_inside_calls_never_work_on_more_than_so_many_at_once() -> None:
    """More of them than workers, each with calls inside, that wait for each other must not wait for ever."""
    lock, working, most = threading.Lock(), set[int](), 0

    def leaf(item: int) -> int:
        nonlocal most
        with lock:
            working.add(threading.get_ident())
            most = max(most, len(working))
        time.sleep(0.001)
        with lock:
            working.discard(threading.get_ident())
        return item

    def outer(item: int) -> list[list[int]]:
        return concurrently(lambda inner: concurrently(leaf, [item, inner]), range(3))

    items = range(4 * WORKERS)
    assert concurrently(outer, items) == [[[item, inner] for inner in range(3)] for item in items]
    assert most == WORKERS


def test_an_idle_core_helps_inside_the_last_long_call() -> None:
    """As soon as nothing else is left: many short calls inside it are enough to see that."""
    workers = set[int]()

    def leaf(_: int) -> None:
        workers.add(threading.get_ident())
        time.sleep(0.001)

    concurrently(lambda item: concurrently(leaf, range(200 * item)), range(2))
    assert len(workers) == WORKERS


def test_an_exception_comes_out_and_the_next_call_works() -> None:
    def work(item: int) -> int:
        if item == 1:
            raise Broken(item)
        return item

    with pytest.raises(Broken, match="1"):
        concurrently(work, range(4))
    assert concurrently(lambda item: item + 1, range(4)) == [1, 2, 3, 4]


def test_an_exception_of_a_call_inside_comes_out_too() -> None:
    def inner(item: int) -> int:
        raise Broken(item)

    with pytest.raises(Broken, match="7"):
        concurrently(lambda item: concurrently(inner, [item, item]), [7, 7])
