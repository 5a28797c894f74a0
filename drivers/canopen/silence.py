"""Whether a heartbeat has ended, or whoever listens for it was not awake to hear it."""

from __future__ import annotations

from typing import Final

GRACE_NS: Final = 100_000_000
"""What a listener that finds a heartbeat overdue leaves for reading what came while it stood still itself [ns]."""


class Silence:
    """The time since the last heartbeat of one node. Time is passed in; nothing here reads a clock.

    Overdue at one look is not enough: a program that was held up, or suspended, finds every heartbeat overdue and
    those that came meanwhile unread. A heartbeat has ended where it is still overdue ``grace_ns`` after it was found.

    Parameters
    ----------
    timeout_ns
        Longest time between two heartbeats [ns].
    grace_ns
        What is left for reading what came while the listener stood still [ns].
    """

    __slots__ = ("_found_ns", "_grace_ns", "_last_ns", "_timeout_ns")

    def __init__(self, timeout_ns: int, grace_ns: int = GRACE_NS) -> None:
        self._timeout_ns = timeout_ns
        self._grace_ns = grace_ns
        self._last_ns: int | None = None
        self._found_ns: int | None = None

    def beat(self, t_ns: int) -> None:
        """Take one heartbeat; the first begins the watch."""
        self._last_ns = t_ns
        self._found_ns = None

    def end(self) -> None:
        """Wait for nothing, until the next heartbeat."""
        self._last_ns = self._found_ns = None

    def length_ns(self, now_ns: int) -> int:
        """Tell how long ago the last heartbeat was [ns]; 0 where none is waited for."""
        return 0 if self._last_ns is None else now_ns - self._last_ns

    def has_ended(self, now_ns: int) -> bool:
        """Look at ``now_ns``, and tell whether the heartbeat has ended."""
        if self.length_ns(now_ns) <= self._timeout_ns:
            return False
        if self._found_ns is None:
            self._found_ns = now_ns
        return now_ns - self._found_ns >= self._grace_ns
