"""Ctrl-C, SIGTERM and the end of the terminal as a request that the run reads between two cycles.

A signal that raised at an arbitrary line could tear a bus library's lock or a half-written row; here it
only sets a flag. Every wait of a run is bounded, so the flag is read within one cycle, or at the end of the
arming step under way.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

STOP_SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""SIGHUP, where the system has it, comes when the terminal or the SSH connection ends."""


class StopRequest:
    """Whether someone asked for the run to end."""

    def __init__(self) -> None:
        self.requested = False

    def request(self) -> None:
        """Ask for the run to end; safe from a signal handler and from another thread."""
        self.requested = True

    def raise_if_requested(self) -> None:
        """End the run here if that was asked for."""
        if self.requested:
            raise KeyboardInterrupt


@contextmanager
def stop_on_signals(stop: StopRequest) -> Iterator[None]:
    """Turn `STOP_SIGNALS` into stop requests, for the time of the block; for the main thread only."""

    def handle(signum: int, frame: FrameType | None) -> None:
        stop.request()

    before = {number: signal.signal(number, handle) for number in STOP_SIGNALS if not _under_nohup(number)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def interrupt_on_signals() -> None:
    """Let every stop signal end this program as Ctrl-C does, wherever no run turns it into a request."""
    for number in STOP_SIGNALS:
        if not _under_nohup(number):
            signal.signal(number, signal.default_int_handler)


def _under_nohup(number: int) -> bool:
    """Whether the program was started to outlive its terminal."""
    return number != signal.SIGINT and signal.getsignal(number) is signal.SIG_IGN
