"""Deadline monitoring of a simulated node's RPDO (CiA 301, 7.5.2.35, event timer of an RPDO).

Time is passed in; nothing here reads a clock. It is simulated time where the rig is driven by SYNC alone, and the
host's where it runs in real time.
"""

from __future__ import annotations

from hil.simulator.heartbeat_consumer import NS_PER_MS


class RpdoDeadline:
    """Watches one RPDO, from the first that comes.

    Parameters
    ----------
    deadline_ms
        Longest time between two [ms]; 0 for no watching.
    """

    __slots__ = ("_deadline_ns", "_last_ns")

    def __init__(self, deadline_ms: int) -> None:
        self._deadline_ns = deadline_ms * NS_PER_MS
        self._last_ns: int | None = None

    def received(self, now_ns: int) -> None:
        """Take the RPDO."""
        self._last_ns = now_ns

    def missed(self, now_ns: int) -> bool:
        """Whether the deadline is past; once, then watching starts anew with the next RPDO."""
        if self._deadline_ns == 0 or self._last_ns is None or now_ns - self._last_ns <= self._deadline_ns:
            return False
        self._last_ns = None
        return True
