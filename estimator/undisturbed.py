"""Signals while other people's code runs that calls back into Python: they are taken when it is done.

An exception that a signal handler raises in such a callback, that of Ctrl-C for one, does not get through: LLVM leaves
its data half freed, and the process ends with a double free; ctypes prints it and continues. So the handlers of this
process are kept away from there in its main thread, and are called behind it.
"""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any, Self

from numba.core import event

SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


class Deferred:
    """Defers signals from its outermost beginning to its end; a context manager. In another thread it does nothing."""

    def __init__(self) -> None:
        self._depth = 0
        self._handlers: dict[int, Any] = {}
        self._met: list[int] = []

    @property
    def is_interrupted(self) -> bool:
        """Whether a signal waits for the end."""
        return bool(self._met)

    def __enter__(self) -> Self:
        """Take the handlers of signals away, where there are any of Python's."""
        if threading.current_thread() is not threading.main_thread():  # no handler is called in another one
            return self
        self._depth += 1
        if self._depth == 1:
            own = {number: signal.getsignal(number) for number in SIGNALS}
            self._handlers = {number: handler for number, handler in own.items() if callable(handler)}
            for number in self._handlers:
                signal.signal(number, self._meet)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None = None,
        error: BaseException | None = None,
        trace: TracebackType | None = None,
    ) -> None:
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


class _Compilation(event.Listener):
    """Defers signals from the beginning of a compilation to its end."""

    def __init__(self) -> None:
        self._signals = Deferred()

    def on_start(self, event: Any) -> None:
        """Begin."""
        self._signals.__enter__()

    def on_end(self, event: Any) -> None:
        self._signals.__exit__()


def compile_undisturbed() -> None:
    """Defer signals from now on while numba compiles."""
    event.register("numba:compile", _Compilation())  # type: ignore[no-untyped-call]  # numba carries none
