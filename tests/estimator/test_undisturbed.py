"""Signals while code is compiled: LLVM does not survive an exception in one of its callbacks."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numba
import pytest
from numba.core import event

import estimator.compiled  # noqa: F401 - has signals deferred


class Sender(event.Listener):
    """Sends a signal to this process at the beginning of every compilation."""

    def __init__(self, number: int) -> None:
        self.number = number
        self.compiled = 0

    def on_start(self, event: Any) -> None:
        signal.raise_signal(self.number)

    def on_end(self, event: Any) -> None:
        self.compiled += 1


@contextmanager
def sending(number: int) -> Iterator[Sender]:
    sender = Sender(number)
    event.register("numba:compile", sender)
    try:
        yield sender
    finally:
        event.unregister("numba:compile", sender)


def inner(x: float) -> float:
    return 2.0 * x


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interruption_is_taken_when_the_outermost_function_is_compiled(number: int) -> None:
    before = signal.signal(number, signal.default_int_handler)
    one = numba.njit(inner)
    both = numba.njit(lambda x: one(x) + 1.0)
    try:
        with sending(number) as sender, pytest.raises(KeyboardInterrupt):
            both(1.0)
        assert sender.compiled == 1  # the inner one; with the end of the outer one the interruption comes
        assert signal.getsignal(number) is signal.default_int_handler
        assert both(1.0) == 3.0
    finally:
        signal.signal(number, before)


def test_a_signal_that_is_ignored_stays_ignored() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with sending(signal.SIGHUP):
            assert numba.njit(inner)(1.0) == 2.0
    finally:
        signal.signal(signal.SIGHUP, before)
