"""Signals while code is compiled: they are taken when it is done.

LLVM calls back into Python. An exception that a signal handler raises there, such as that of Ctrl-C, leaves its data
half freed, and the process ends with a double free. So the handlers of this process are kept away from the outermost
compilation of its main thread, and are called behind it.
"""

from __future__ import annotations

import signal
import threading
from types import FrameType
from typing import Any

from numba.core import event

SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


class Undisturbed(event.Listener):
    """Defers signals from the beginning of a compilation to its end."""

    def __init__(self) -> None:
        self._depth = 0
        self._handlers: dict[int, Any] = {}
        self._met: list[int] = []

    def on_start(self, event: Any) -> None:
        """Take the handlers of signals away, where there are any of Python's."""
        if threading.current_thread() is not threading.main_thread():  # no handler is called in another one
            return
        self._depth += 1
        if self._depth == 1:
            own = {number: signal.getsignal(number) for number in SIGNALS}
            self._handlers = {number: handler for number, handler in own.items() if callable(handler)}
            for number in self._handlers:
                signal.signal(number, self._meet)

    def on_end(self, event: Any) -> None:
        """Give them back, and have them called for what has come meanwhile."""
        if threading.current_thread() is not threading.main_thread():
            return
        self._depth -= 1
        if self._depth == 0:
            for number, handler in self._handlers.items():
                signal.signal(number, handler)
            met, self._met = self._met, []
            for number in met:
                signal.raise_signal(number)

    def _meet(self, number: int, frame: FrameType | None) -> None:
        self._met.append(number)


def compile_undisturbed() -> None:
    """Defer signals from now on while numba compiles."""
    event.register("numba:compile", Undisturbed())  # type: ignore[no-untyped-call]  # numba carries none
