"""Something done again and again by the wall clock, in a thread of its own."""

from __future__ import annotations

import threading
from collections.abc import Callable


class Ticker:
    """Calls until stopped.

    Parameters
    ----------
    period_s
        Time between two calls [s].
    call
        What is called; it raises nothing.
    name
        Of the thread.
    """

    def __init__(self, period_s: float, call: Callable[[], None], name: str) -> None:
        self._period_s = period_s
        self._call = call
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread; nothing is called after this returns."""
        self._stopping.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._stopping.wait(self._period_s):
            self._call()
