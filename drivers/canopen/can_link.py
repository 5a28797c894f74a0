"""One CAN bus: opened by URL, received by a thread, with ``canopen``'s network on top.

Every frame is stamped once, with the host's monotonic clock, where it arrives. The receive thread is this
module's own: ``canopen``'s swallows what a callback raises and leaves a dead bus unnoticed. What goes wrong
in the thread is kept and raised in the caller's next call. On a virtual bus of this process there is no such
thread: a frame is received in the thread that sends it (`drivers.canopen.inline_bus`).
"""

from __future__ import annotations

import logging
import struct
import threading
import time
from collections.abc import Callable
from copy import copy
from http.client import HTTPException
from typing import Any, Self
from urllib.parse import parse_qsl, urlsplit

import can
import canopen

from drivers.canopen.foreign_controllers import Strangers
from drivers.canopen.heartbeat import HEARTBEAT_COB_ID, HOST_NODE_ID, NMT_COB_ID, HeartbeatProducer, NmtState
from drivers.canopen.inline_bus import InlineBus
from drivers.canopen.remote_bus import BoundedRemoteBus
from drivers.errors import BusDown, ProtocolViolation

logging.getLogger("canopen").addHandler(logging.NullHandler())  # our errors say it; canopen would print it too

SYNC_COB_ID = 0x080
FrameCallback = Callable[[bytes, int], None]
"""``callback(data, t_ns)``, called where frames are received; ``t_ns`` is the monotonic time of arrival."""

Tap = Callable[[can.Message, int], None]
"""``tap(message, t_ns)``, called for every frame sent, just before, and received; it keeps neither thread waiting."""

BUS_OFF = 0x040
"""Error class of an error frame: the controller is off the bus (CAN_ERR_BUSOFF of Linux; python-can passes it on)."""

_RECEIVE_POLL_S = 0.02  # how long `CanLink.close` may wait for the receive thread


_OPENING_ERRORS = (can.CanError, HTTPException, ImportError, NotImplementedError, OSError, TypeError, ValueError)
"""What opening a bus raises, by back end: all of them mean it can't be opened as the URL has it."""


def is_canopen(message: can.Message) -> bool:
    """Whether a frame may be one of CANopen's: data, classic CAN, an identifier of 11 bits.

    A frame with 29 bits is another protocol's on the same wire (SAE J1939), whatever number its identifier is; so is
    CAN FD. Remote frames are asked of nobody here.
    """
    return not (message.is_extended_id or message.is_remote_frame or message.is_error_frame or message.is_fd)


class _Network(canopen.Network):
    """A canopen network whose sending raises `BusDown`, whatever the back end calls it."""

    def __init__(self, bus: can.BusABC, raise_if_down: Callable[[], None]) -> None:
        super().__init__(bus)
        self._wire = bus
        self.tap: Tap | None = None
        self._raise_if_down = raise_if_down
        self._send: Callable[[can.Message], None] = self._send_alone
        if isinstance(bus, InlineBus):  # what a frame sets off is done before its sending returns: it may send itself
            self._send = bus.hand_out

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        self._raise_if_down()
        message = can.Message(arbitration_id=can_id, is_extended_id=False, is_remote_frame=remote, data=data)
        try:
            if self.tap is not None:
                message.is_rx = False
                self.tap(copy(message), time.monotonic_ns())
            self._send(message)
        except (can.CanError, OSError) as error:
            raise BusDown(
                f"CAN bus {self.bus}: frame 0x{can_id:03X} can't be sent ({error}), expected a bus "
                "that takes "
                "it. Check adapter, cable and termination."
            ) from error

    def _send_alone(self, message: can.Message) -> None:
        with self.send_lock:  # few adapters can be written to by two threads at a time
            self._wire.send(message)


class CanLink:
    """A bus in use, with its receive thread."""

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus
        self._subscribers: dict[int, list[FrameCallback]] = {}
        self._closing = threading.Event()
        self._lost: Exception | None = None
        self._defect: Exception | None = None
        self._violation: ProtocolViolation | None = None
        self._producer: HeartbeatProducer | None = None
        self.network = _Network(bus, self._raise_if_down)
        self.pdos_to_disable = Strangers(self.subscribe)
        self._thread: threading.Thread | None = None
        if isinstance(bus, InlineBus):
            bus.receive_by(self._take)
        else:
            self._thread = threading.Thread(target=self._receive, name=f"CAN receive, {bus}", daemon=True)
            self._thread.start()

    @classmethod
    def open(cls, url: str) -> CanLink:
        """Open the bus a URL names."""
        return cls(open_bus(url))

    def subscribe(self, cob_id: int, callback: FrameCallback) -> None:
        """Have ``callback`` called for every frame with this identifier, where frames are received."""
        self._subscribers.setdefault(cob_id, []).append(callback)

    def trace_by(self, tap: Tap | None) -> None:
        """Have ``tap`` called for every frame from now on, sent or received; None ends it."""
        self.network.tap = tap

    def send(self, cob_id: int, data: bytes) -> None:
        """Send one frame with classic CAN's up to 8 bytes."""
        self.network.send_message(cob_id, data)

    def sync(self) -> int:
        """Send SYNC; return when, on the host's monotonic clock [ns]."""
        self.raise_if_failed()
        t_ns = time.monotonic_ns()
        self.network.send_message(SYNC_COB_ID, b"")
        return t_ns

    def watch_strangers(self, host_node_id: int) -> None:
        """Look out, from now on, for another controller: its SYNC, NMT commands, or this host's heartbeat."""
        self.pdos_to_disable.claim(SYNC_COB_ID, "SYNC")
        self.pdos_to_disable.claim(NMT_COB_ID, "an NMT command")
        self.pdos_to_disable.claim(HEARTBEAT_COB_ID + host_node_id, f"the heartbeat of the host, node {host_node_id}")
        self.pdos_to_disable.watch()

    def produce_heartbeat(self, period_s: float, node_id: int = HOST_NODE_ID) -> None:
        """Send the host's own heartbeat from now on, so that drives notice when the host is gone.

        Asked for more than once, by each of several drives, the shortest period holds.
        """
        if self._producer is not None:
            self._producer.period_s = min(self._producer.period_s, period_s)
        else:
            self._producer = HeartbeatProducer(self.send, node_id, period_s, lambda: NmtState.OPERATIONAL)

    def beat(self) -> None:
        """Send one heartbeat of the host now: a consumer watches from the first it hears (CiA 301, object 1016h)."""
        if self._producer is not None:
            self._producer.beat()

    def stop_heartbeat(self) -> None:
        """Send no heartbeat any more, until `produce_heartbeat`; drives then take the host for dead."""
        if self._producer is not None:
            self._producer.stop()
            self._producer = None

    def raise_if_failed(self) -> None:
        """Raise what the receive thread met."""
        self._raise_if_down()
        violation, self._violation = self._violation, None
        if violation is not None:
            raise violation

    def _raise_if_down(self) -> None:
        if self._lost is not None:
            raise BusDown(
                f"CAN bus {self._bus}: receiving ended ({self._lost or type(self._lost).__name__}), "
                "expected a "
                "bus that stays. Check adapter, cable and, with hil sim, that the server still runs."
            ) from self._lost
        if self._closing.is_set():
            raise BusDown(f"CAN bus {self._bus} is closed, expected an open one. Open the link again.")

    def _receive(self) -> None:
        while self._lost is None and not self._closing.is_set():
            try:
                message = self._bus.recv(_RECEIVE_POLL_S)
                off = message is None and self._bus.state is can.BusState.ERROR
            except Exception as error:  # noqa: BLE001 - each back end raises its own; all mean the bus is gone
                self._lost = error
                return
            if message is not None:
                self._take(message)
            elif off:
                self._take_error(BUS_OFF)

    def _take(self, message: can.Message) -> None:
        """Take one frame; after a defect nothing is taken any more."""
        if self._lost is not None:
            return
        t_ns = time.monotonic_ns()
        try:
            if self.network.tap is not None:
                self.network.tap(message, t_ns)
            if message.is_error_frame:
                self._take_error(message.arbitration_id)
            elif is_canopen(message):
                self._dispatch(message.arbitration_id, bytes(message.data), t_ns)
        except BusDown as error:  # a callback had to answer, and the bus has gone, or been closed, meanwhile
            self._lost = error
        except Exception as error:  # noqa: BLE001 - a defect of this program: raised by close()
            self._lost = self._defect = error

    def _take_error(self, error_class: int) -> None:
        if error_class & BUS_OFF:
            self._lost = can.CanOperationError("bus-off: the controller has left the bus after too many errors")

    def _dispatch(self, cob_id: int, data: bytes, t_ns: int) -> None:
        try:
            for callback in self._subscribers.get(cob_id, ()):
                callback(data, t_ns)
            if cob_id in self.network.subscribers:
                self.network.notify(cob_id, bytearray(data), t_ns)
        except ProtocolViolation as violation:
            self._violation = violation
        except struct.error as error:  # what canopen's decoders raise for a frame that is too short
            self._violation = ProtocolViolation(
                f"CAN bus {self._bus}: frame 0x{cob_id:03X} with data [{data.hex(' ')}] is not what "
                f"CiA 301 has there ({error}). Check the device's firmware version."
            )

    def close(self) -> None:
        """End the threads and shut the bus down; calling it again does nothing."""
        self.stop_heartbeat()
        self._closing.set()
        if self._thread is not None:
            self._thread.join()
        self._bus.shutdown()
        defect, self._defect = self._defect, None
        if defect is not None:
            raise defect

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_bus(url: str) -> can.BusABC:
    """Open the bus a URL names, as `CanLink.open` takes it."""
    try:
        return BoundedRemoteBus(url) if url.startswith(("ws:", "wss:")) else _python_can_bus(url)
    except _OPENING_ERRORS as error:
        raise BusDown(
            f"CAN bus {url!r} can't be opened: {error or type(error).__name__}. Expected virtual:NAME, "
            "ws://HOST:PORT/ with a server running there (hil sim), or INTERFACE:CHANNEL?bitrate=... of "
            "a connected adapter. Check the bus URL of the rig file."
        ) from error


def _python_can_bus(url: str) -> can.BusABC:
    """Open ``interface:channel?key=value``; configuration files of the machine are left out of it."""
    parts = urlsplit(url)
    if not parts.scheme or not parts.path:
        raise ValueError("the URL names no interface and channel")
    options: dict[str, Any] = {key: int(value) if value.isdecimal() else value for key, value in parse_qsl(parts.query)}
    if parts.scheme == "virtual":
        return InlineBus(parts.path, **options)
    return can.Bus(interface=parts.scheme, channel=parts.path, ignore_config=True, **options)
