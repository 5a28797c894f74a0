"""Whether a heartbeat has ended, or whoever listens for it was not awake to hear it."""

from __future__ import annotations

from typing import Final

GRACE_NS: Final = 100_000_000
"""What a listener that finds a heartbeat overdue leaves for reading what came while it stood still itself [ns]."""


class Silence:
    """The time since the last heartbeat of one node. Time is passed in; nothing here reads a clock.

    Overdue at one look is not enough: a program that was held up, or suspended, finds every heartbeat overdue and
    those that came meanwhile unread. A heartbeat has ended where it is still overdue after ``grace_ns`` of being awake.
    """

    __slots__ = ("_awake_ns", "_grace_ns", "_last_ns", "_longest_look_ns", "_looked_ns", "_timeout_ns")

    def __init__(self, timeout_ns: int, grace_ns: int = GRACE_NS, longest_look_ns: int | None = None) -> None:
        self._timeout_ns = timeout_ns
        self._grace_ns = grace_ns
        self._longest_look_ns = grace_ns if longest_look_ns is None else longest_look_ns
        self._awake_ns = 0
        self._last_ns: int | None = None
        self._looked_ns: int | None = None

    def beat(self, t_ns: int) -> None:
        """Take one heartbeat; the first begins the watch."""
        self._last_ns = t_ns
        self._looked_ns = None

    def end(self) -> None:
        """Wait for nothing, until the next heartbeat."""
        self._last_ns = self._looked_ns = None

    def length_ns(self, now_ns: int) -> int:
        """Tell how long ago the last heartbeat was [ns]; 0 where none is waited for."""
        return 0 if self._last_ns is None else now_ns - self._last_ns

    def has_ended(self, now_ns: int) -> bool:
        """Look at ``now_ns``, and tell whether the heartbeat has ended."""
        if self.length_ns(now_ns) <= self._timeout_ns:
            return False
        if self._looked_ns is None:
            self._awake_ns = 0
        else:
            self._awake_ns += min(now_ns - self._looked_ns, self._longest_look_ns)
        self._looked_ns = now_ns
        return self._awake_ns >= self._grace_ns
