"""Health of one node as the bus shows it: heartbeat, NMT state, emergencies."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from drivers.canopen import emcy
from drivers.canopen.heartbeat import HeartbeatMonitor, NmtState
from drivers.errors import DeviceFault, DeviceTimeout, ProtocolViolation

_CONNECTION_CLASSES = (0x8100, 0x8200)
"""Error classes communication and protocol (CiA 301, table "Emergency error codes")."""

ASK_AGAIN_S = 0.1
"""Between two NMT commands for the same state: a node has its heartbeat, or the next one, by then."""

_NMT_STATES = {state.value: state for state in NmtState}


class NodeMonitor:
    """Takes heartbeats and EMCY frames in the receive thread, judges them in the caller's."""

    def __init__(self, where: str, heartbeat_timeout_ns: int) -> None:
        self._where = where
        self._heartbeat = HeartbeatMonitor(where, heartbeat_timeout_ns, time.monotonic_ns())
        self._changed = threading.Condition()
        self._emergency: emcy.Emergency | None = None
        self._past_emergency: emcy.Emergency | None = None
        self._expected: NmtState | None = None
        self._beats = 0
        self._strayed: NmtState | None = None

    @property
    def emergency(self) -> emcy.Emergency | None:
        """The first emergency that is not reset yet."""
        return self._emergency

    def on_heartbeat(self, data: bytes, t_ns: int) -> None:
        """Take a heartbeat or boot-up frame."""
        state = _NMT_STATES.get(data[0] & 0x7F) if len(data) == 1 else None
        if state is None:
            raise ProtocolViolation(
                f"{self._where}: heartbeat [{data.hex(' ')}], expected one byte 00, 04, 05 or 7F. "
                "Check the device's firmware version."
            )
        with self._changed:
            self._heartbeat.beat(state, t_ns)
            self._beats += 1
            if self._expected is not None and state is not self._expected and self._strayed is None:
                self._strayed = state
            self._changed.notify_all()

    def on_emergency(self, data: bytes, t_ns: int) -> None:
        """Take an EMCY frame; the first that is not yet reset is kept, for it names the cause."""
        emergency = emcy.decode(data)
        if emergency.is_reset:
            self._past_emergency, self._emergency = self._emergency or self._past_emergency, None
        elif self._emergency is None:
            self._emergency = emergency

    def forget_emergency(self) -> None:
        """Take the emergency for reset, as after a fault reset that the drive has confirmed."""
        self._emergency = None

    def forget_lost_host(self) -> None:
        """Take an emergency about the connection for gone: it was about a host before this one."""
        if self._emergency is not None and self._emergency.code & 0xFF00 in _CONNECTION_CLASSES:
            self._emergency = None

    def expect(self, state: NmtState | None) -> None:
        """Have `raise_if_unwell` refuse any other NMT state from now on, be it in one heartbeat between two looks."""
        self._expected = state
        self._strayed = None
        self._past_emergency = None

    def await_state(self, state: NmtState, timeout_s: float, ask: Callable[[], None]) -> None:
        """Ask for a state, again and again, until a heartbeat that comes after the first time reports it.

        No NMT command is acknowledged: it may be lost, and a node that still writes what it was given does not
        take it.
        """
        deadline = time.monotonic() + timeout_s
        ask()
        first = self._beats
        while not self._reports(state, first, min(ASK_AGAIN_S, deadline - time.monotonic())):
            if time.monotonic() >= deadline:
                raise DeviceTimeout(
                    f"{self._where}: last heartbeat reports {_title(self._heartbeat.state)} after "
                    f"{timeout_s:g} s, expected {state.title}. Check power, node id and wiring, and that "
                    "the drive produces a heartbeat (0x1017)."
                )
            ask()

    def _reports(self, state: NmtState, first: int, timeout_s: float) -> bool:
        """Wait for a heartbeat behind number ``first`` that reports a state."""
        with self._changed:
            return self._changed.wait_for(
                lambda: self._beats != first and self._heartbeat.state is state, max(timeout_s, 0.0)
            )

    def raise_if_unwell(self, now_ns: int) -> None:
        """Check emergencies, heartbeat and NMT state at ``now_ns``."""
        if self._emergency is not None:
            raise DeviceFault(
                f"{self._where}: {self._emergency}, expected none. Fix the cause at the drive, reset the fault."
            )
        self._heartbeat.raise_if_lost(now_ns)
        if self._expected is not None and self._past_emergency is not None:
            raise DeviceFault(
                f"{self._where}: {self._past_emergency}, and its end, expected none. It went away by itself: read the "
                "drive's list of errors (0x1003)."
            )
        state = self._heartbeat.state if self._strayed is None else self._strayed
        if self._expected is not None and state is not self._expected:
            cause = "Something else reset or stopped the drive"
            if self._past_emergency is not None:
                cause = f"It sent {self._past_emergency}, and its end"
            raise DeviceFault(
                f"{self._where}: NMT state is {_title(state)}, expected {self._expected.title}. {cause}; "
                "configure it again."
            )


def _title(state: NmtState | None) -> str:
    """Name a state; INITIALISING is 0, so truth tells nothing."""
    return "nothing so far" if state is None else state.title
