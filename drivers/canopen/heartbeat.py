"""NMT states, and heartbeat in both directions (CiA 301, 7.2.8.2.2).

``canopen`` sends heartbeats from a timer it does not join when it stops, and has no monitor for their loss.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from enum import IntEnum

from drivers.canopen.silence import Silence
from drivers.errors import BusDown, DeviceTimeout

NMT_COB_ID = 0x000
HEARTBEAT_COB_ID = 0x700  # plus the node id

HOST_NODE_ID = 127
"""Node id of the host's own heartbeat where the rig file has no other: the highest, so that it yields to every
device."""


class NmtState(IntEnum):
    """State of a node as its heartbeat gives it."""

    INITIALISING = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127

    @property
    def title(self) -> str:
        """Name for messages."""
        return self.name.replace("_", "-")


class NmtCommand(IntEnum):
    """Command specifier of the NMT frame."""

    START = 1
    STOP = 2
    ENTER_PRE_OPERATIONAL = 128
    RESET_NODE = 129
    RESET_COMMUNICATION = 130


def nmt_frame(command: NmtCommand, node_id: int) -> bytes:
    """Build the data of an NMT frame; node id 0 means all nodes."""
    return bytes((command, node_id))


class HeartbeatMonitor:
    """Watches one node's heartbeat. Time is passed in; nothing here reads a clock."""

    def __init__(self, where: str, timeout_ns: int, started_ns: int) -> None:
        self._where = where
        self._timeout_ns = timeout_ns
        self._silence = Silence(timeout_ns)
        self._silence.beat(started_ns)
        self.state: NmtState | None = None

    def beat(self, state: NmtState, t_ns: int) -> None:
        """Take a heartbeat that arrived at ``t_ns`` on the host's monotonic clock."""
        self.state = state
        self._silence.beat(t_ns)

    def raise_if_lost(self, now_ns: int) -> None:
        """Raise DeviceTimeout if no heartbeat has come for too long, ``now_ns`` being the host's monotonic clock."""
        if not self._silence.has_ended(now_ns):
            return
        age_ns = self._silence.length_ns(now_ns)
        seen = "never" if self.state is None else f"{age_ns / 1e6:.0f} ms ago, in {self.state.title}"
        raise DeviceTimeout(
            f"{self._where}: last heartbeat {seen}, expected one every {self._timeout_ns / 1e6:.0f} ms at "
            "the latest. Check power, node id and wiring; a drive that hangs must be power-cycled."
        )


class HeartbeatProducer:
    """Sends this node's heartbeat from a thread of its own until stopped."""

    def __init__(
        self, send: Callable[[int, bytes], None], node_id: int, period_s: float, state: Callable[[], NmtState]
    ) -> None:
        self._send = send
        self._cob_id = HEARTBEAT_COB_ID + node_id
        self.period_s = period_s
        self._state = state
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"heartbeat of node {node_id}", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._stop.is_set():
            try:
                self._send(self._cob_id, bytes((self._state(),)))
            except BusDown:  # whoever uses the bus gets the same error at the next call
                return
            self._stop.wait(self.period_s)

    def beat(self) -> None:
        """Send one now, besides those of the period."""
        self._send(self._cob_id, bytes((self._state(),)))

    def stop(self) -> None:
        """End the thread; no heartbeat is sent after this returns."""
        self._stop.set()
        self._thread.join()
