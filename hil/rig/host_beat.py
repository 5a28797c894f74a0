"""The host's beat for the PLC while drives are configured and armed, before the cycle polls the PLC.

That takes longer than a PLC may wait for its host.
"""

from __future__ import annotations

from concurrent.futures import Future
from types import TracebackType
from typing import Self

from drivers.plc.plc import Plc
from hil.errors import RunAborted
from hil.rig.plc_loop import PlcLoop


class HostBeat:
    """Beats from `__enter__` until `hand_over`, or the end of the block.

    Parameters
    ----------
    loop
        Where the PLC's client runs.
    plc
        The client, connected.
    """

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

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end()  # what ended the block comes first

    def _end(self) -> BaseException | None:
        self._on = False
        beating, self._beating = self._beating, None
        return None if beating is None else beating.exception()
