"""The host's watchdog in the PLC: a count that the host moves on, and that the PLC shows to have seen."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from drivers.errors import DeviceTimeout
from drivers.plc.named_registers import NamedRegisters

COUNTS: Final = 65536
"""The count starts over here, so that it fits 16 bits."""

NS_PER_S: Final = 1_000_000_000


class HostWatchdog:
    """Counts beats.

    Parameters
    ----------
    registers : NamedRegisters
        With ``host_count`` and ``host_count_seen``.
    place : str
        Of the PLC, for messages.
    timeout_s : float
        Time the PLC may leave a beat unseen [s].
    clock_ns : callable
        Monotonic clock [ns].
    """

    __slots__ = ("_clock_ns", "_count", "_place", "_registers", "_seen_ns", "_timeout_s")

    def __init__(self, registers: NamedRegisters, place: str, timeout_s: float, clock_ns: Callable[[], int]) -> None:
        self._registers = registers
        self._place = place
        self._timeout_s = timeout_s
        self._clock_ns = clock_ns
        self._count: int | None = None
        self._seen_ns = 0

    def start_anew(self) -> None:
        """Begin at 0 with the next beat: the connection is another."""
        self._count = None

    async def beat(self) -> None:
        """Move the count on by one, and see that the PLC has seen the beats before."""
        now_ns = self._clock_ns()
        if self._count is None:
            self._seen_ns = now_ns
        else:
            await self._require_seen(self._count, now_ns)
        count = 0 if self._count is None else (self._count + 1) % COUNTS
        await self._registers.write(self._registers.encoded({"host_count": count}))
        self._count = count

    async def _require_seen(self, count: int, now_ns: int) -> None:
        seen = (await self._registers.read(("host_count_seen",)))["host_count_seen"]
        if seen == count:
            self._seen_ns = now_ns
        elif now_ns - self._seen_ns > self._timeout_s * NS_PER_S:
            raise DeviceTimeout(
                f"{self._place}: watchdog: expected beat {count} seen by the PLC within "
                f"{self._timeout_s:g} s, it has seen {seen}. Check that the PLC's program runs."
            )
