"""Read a PLC that may go away and come back: for checking and monitoring, where nothing depends on one answer.

A lost connection is made again, with pauses that double, and a bounded number of times. It only reads, but for the
host's beat: what else was to be written when a connection was lost, nobody knows to have arrived, so that writing again
is a person's decision.
A run does not use this; there a lost PLC ends it (`hil.rig.plc_watch`).
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass
from typing import Final, Self, TypeVar

from drivers.errors import BusDown, ConfigMismatch, DeviceTimeout
from drivers.plc.named_registers import Reading
from drivers.plc.plc import Plc
from drivers.plc.types import PlcStatus

T = TypeVar("T")

PASSING: Final = (BusDown, DeviceTimeout)
"""What may be over at the next attempt; everything else is a PLC that is there and says so."""


@dataclass(frozen=True, slots=True)
class Backoff:
    """Pauses between attempts."""

    first_s: float = 0.2  # the first pause [s]; each next one is twice as long
    longest_s: float = 5.0  # the longest [s]
    attempts: int = 6  # attempts in all, the first one counted

    def __post_init__(self) -> None:
        if self.attempts < 1 or not 0.0 < self.first_s <= self.longest_s:
            raise ConfigMismatch(
                f"back-off: expected at least one attempt and 0 < first_s <= longest_s, got {self}. Correct the caller."
            )

    def pauses_s(self) -> Iterator[float]:
        """Give the pause after each attempt but the last [s]."""
        return (min(self.first_s * 2.0**n, self.longest_s) for n in range(self.attempts - 1))


class PlcReader:
    """Reads the PLC's status whenever it can be read; an asynchronous context manager."""

    def __init__(
        self, plc: Plc, backoff: Backoff | None = None, sleep: Callable[[float], Awaitable[None]] = asyncio.sleep
    ) -> None:
        self._plc = plc
        self._backoff = backoff or Backoff()
        self._sleep = sleep
        self._connected = False

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        self._plc.close()

    async def read_status(self) -> PlcStatus:
        """Read the status; connect first where there is no connection, or no longer one."""
        return await self._read(self._plc.read_status)

    async def greet(self) -> PlcStatus:
        """Beat and read the status, as `Plc.greet`; connect first as `read_status` does."""
        return await self._read(self._plc.greet)

    async def read_registers(self) -> tuple[Reading, ...]:
        """Read every register of the map, as `Plc.read_registers` gives them; connect first as `read_status` does."""
        return await self._read(self._plc.read_registers)

    async def _read(self, read: Callable[[], Awaitable[T]]) -> T:
        for pause_s in self._backoff.pauses_s():
            try:
                return await self._attempt(read)
            except PASSING:
                await self._sleep(pause_s)
        return await self._attempt(read)

    async def _attempt(self, read: Callable[[], Awaitable[T]]) -> T:
        try:
            if not self._connected:
                await self._plc.connect()
            self._connected = True
            return await read()
        except PASSING:
            self._connected = False
            self._plc.close()
            raise
