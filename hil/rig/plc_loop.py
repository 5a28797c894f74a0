"""The PLC's asyncio client on an event loop of its own thread: the torque cycle never waits for Modbus.

There too the host's beat while drives are configured and armed, before the cycle polls the PLC: that takes longer than
a PLC may wait for its host.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Coroutine
from concurrent.futures import Future
from typing import Any, Self, TypeVar

from drivers.plc.plc import Plc
from hil.errors import RunAborted

T = TypeVar("T")


class PlcLoop:
    """An event loop in a thread, from `__enter__` to `__exit__`."""

    __slots__ = ("_loop", "_thread")

    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="plc", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self.call(_cancel_rest())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def start(self, coroutine: Coroutine[Any, Any, T]) -> Future[T]:
        """Start a coroutine and return at once."""
        return asyncio.run_coroutine_threadsafe(coroutine, self._loop)

    def call(self, coroutine: Coroutine[Any, Any, T]) -> T:
        """Run a coroutine to its end; the drivers bound how long that takes."""
        return self.start(coroutine).result()


async def _cancel_rest() -> None:
    """End what still runs, such as a poll that was under way when the run ended."""
    rest = asyncio.all_tasks() - {asyncio.current_task()}
    for task in rest:
        task.cancel()
    await asyncio.gather(*rest, return_exceptions=True)


class HostBeat:
    """Beats from `__enter__` until `hand_over`, or the end of the block."""

    __slots__ = ("_beating", "_loop", "_on", "_plc")

    def __init__(self, loop: PlcLoop, plc: Plc) -> None:
        self._loop = loop
        self._plc = plc
        self._on = False
        self._beating: Future[None] | None = None

    def __enter__(self) -> Self:
        self._on = True
        self._beating = self._loop.start(self._plc.keep_beating(lambda: self._on))
        return self

    def hand_over(self) -> None:
        """End beating, with the beat under way: from now on somebody else does."""
        if error := self._end():
            raise RunAborted(f"PLC: expected it to see the host's beats, got: {error}") from error

    def __exit__(self, *error: object) -> None:
        self._end()  # what ended the block comes first

    def _end(self) -> BaseException | None:
        self._on = False
        beating, self._beating = self._beating, None
        return None if beating is None else beating.exception()
