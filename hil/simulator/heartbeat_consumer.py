"""What a simulated node does with the host's heartbeat (CiA 301, object 1016h): notice that it has ended.

Time is passed in; nothing here reads a clock. The node asks with the frames it takes and by a clock of its
own.
"""

from __future__ import annotations

from typing import Self

from drivers.canopen.heartbeat import HEARTBEAT_COB_ID
from drivers.canopen.silence import Silence

NS_PER_MS = 1_000_000

GRACE_NS = 40 * NS_PER_MS
"""What this program, which is no drive, leaves for reading heartbeats that came while it was held up itself [ns]."""

LONGEST_LOOK_NS = 15 * NS_PER_MS
"""It looks every 10 ms: a longer time between two looks is one in which it was held up."""


class HeartbeatConsumer:
    """Watches one heartbeat, from the first that comes; off by default.

    Parameters
    ----------
    node_id
        Whose heartbeat it is.
    timeout_ms
        Longest time between two [ms]; 0 for no watching.
    """

    __slots__ = ("_silence", "_watches", "cob_id")

    def __init__(self, node_id: int = 0, timeout_ms: int = 0) -> None:
        self.cob_id = HEARTBEAT_COB_ID + node_id
        self._watches = timeout_ms > 0
        self._silence = Silence(timeout_ms * NS_PER_MS, GRACE_NS, LONGEST_LOOK_NS)

    @classmethod
    def from_object(cls, value: int) -> Self:
        """Read the object: node id in bits 16 to 22, time in bits 0 to 15 [ms]."""
        return cls(value >> 16 & 0x7F, value & 0xFFFF)

    def beat(self, t_ns: int) -> None:
        """Take one heartbeat."""
        self._silence.beat(t_ns)

    def lost(self, now_ns: int) -> bool:
        """Whether the heartbeat has ended; once, then watching starts anew with the next one."""
        if not self._watches or not self._silence.has_ended(now_ns):
            return False
        self._silence.end()
        return True
