"""Work on both cores: order, nesting and exceptions are those of a plain loop."""

from __future__ import annotations

import threading

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


def test_calls_inside_a_call_run_one_after_the_other_in_its_own_thread() -> None:
    """More of them than workers, each with a call inside, would otherwise wait for each other for ever."""

    def outer(item: int) -> tuple[int, list[tuple[int, int]]]:
        return threading.get_ident(), concurrently(lambda inner: (item + inner, threading.get_ident()), range(3))

    for item, (worker, inner) in enumerate(concurrently(outer, range(4 * WORKERS))):
        assert worker != threading.get_ident()
        assert inner == [(item, worker), (item + 1, worker), (item + 2, worker)]


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
