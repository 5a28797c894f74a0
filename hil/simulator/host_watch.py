"""How a simulated node tells that its host is gone: by its heartbeat, and by its RPDOs, as the host has configured.

The heartbeat is of the wall clock; the RPDOs' deadline is of simulated time, or of the wall clock in a rig that runs
in real time. Simulated time stands still between two SYNCs, however long that takes, and an RPDO is as old as the SYNC
that puts it into effect. Time is passed in; nothing here reads a clock.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from hil.simulator.heartbeat_consumer import HeartbeatConsumer
from hil.simulator.rpdo_deadline import RpdoDeadline

HEARTBEAT_ERROR: Final = 0x8130
RPDO_TIMEOUT: Final = 0x8250
"""Error codes of CiA 301."""


class HostWatch:
    """The watch of one node.

    Parameters
    ----------
    real_time
        Whether the deadline of the RPDOs is of the wall clock.
    """

    __slots__ = ("_deadlines", "_next_sync_ns", "_real_time", "_sync_ns", "heartbeat")

    def __init__(self, real_time: bool) -> None:
        self._real_time = real_time
        self._sync_ns = self._next_sync_ns = 0
        self._deadlines: dict[int, RpdoDeadline] = {}
        self.heartbeat = HeartbeatConsumer()

    def clear(self) -> None:
        """Watch nobody, as at power-on."""
        self.heartbeat = HeartbeatConsumer()
        self._deadlines.clear()

    def watch_rpdos(self, deadlines_ms: Mapping[int, int]) -> None:
        """Watch these RPDOs from the first of each on, by COB-ID [ms]; 0 is not at all."""
        self._deadlines = {cob_id: RpdoDeadline(deadline_ms) for cob_id, deadline_ms in deadlines_ms.items()}

    def take_sync(self, period_s: float) -> None:
        """Let simulated time advance to this SYNC; the next one comes after ``period_s`` [s]."""
        self._sync_ns = self._next_sync_ns
        self._next_sync_ns += round(period_s * 1e9)

    def received(self, cob_id: int, wall_ns: int) -> None:
        """Take an RPDO, at this time of the wall clock [ns]."""
        self._deadlines[cob_id].received(wall_ns if self._real_time else self._next_sync_ns)

    def heartbeat_lost(self, wall_ns: int) -> bool:
        """Whether the host's heartbeat has ended; reported once."""
        return self.heartbeat.lost(wall_ns)

    def rpdo_missed(self, wall_ns: int) -> bool:
        """Whether an RPDO is overdue; reported once for each."""
        now_ns = wall_ns if self._real_time else self._sync_ns
        missed = [deadline.missed(now_ns) for deadline in self._deadlines.values()]  # every one is asked
        return any(missed)
