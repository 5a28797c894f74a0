"""How a simulated node tells that its host is gone: by its heartbeat, and by its RPDOs, as the host has configured.

The heartbeat is of the wall clock; the RPDOs' deadline is of simulated time, or of the wall clock in a rig that runs
in real time. Time is passed in; nothing here reads a clock.
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

    __slots__ = ("_deadlines", "_real_time", "_simulated_ns", "heartbeat")

    def __init__(self, real_time: bool) -> None:
        self._real_time = real_time
        self._simulated_ns = 0
        self._deadlines: dict[int, RpdoDeadline] = {}
        self.heartbeat = HeartbeatConsumer()

    def clear(self) -> None:
        """Watch nobody, as at power-on."""
        self.heartbeat = HeartbeatConsumer()
        self._deadlines.clear()

    def watch_rpdos(self, deadlines_ms: Mapping[int, int]) -> None:
        """Watch these RPDOs from the first of each on, by COB-ID [ms]; 0 is not at all."""
        self._deadlines = {cob_id: RpdoDeadline(deadline_ms) for cob_id, deadline_ms in deadlines_ms.items()}

    def pass_simulated_time(self, period_s: float) -> None:
        """Let a period of simulated time pass [s]."""
        self._simulated_ns += round(period_s * 1e9)

    def received(self, cob_id: int, wall_ns: int) -> None:
        """Take an RPDO, at this time of the wall clock [ns]."""
        self._deadlines[cob_id].received(self._now_ns(wall_ns))

    def heartbeat_lost(self, wall_ns: int) -> bool:
        """Whether the host's heartbeat has ended; told once."""
        return self.heartbeat.lost(wall_ns)

    def rpdo_missed(self, wall_ns: int) -> bool:
        """Whether an RPDO is overdue; told once for each."""
        now_ns = self._now_ns(wall_ns)
        missed = [deadline.missed(now_ns) for deadline in self._deadlines.values()]  # every one is asked
        return any(missed)

    def _now_ns(self, wall_ns: int) -> int:
        return wall_ns if self._real_time else self._simulated_ns
