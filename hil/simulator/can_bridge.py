"""Serve a virtual CAN channel to other processes: python-can-remote's WebSocket server, closed to strangers.

The library serves whoever comes: a page in a browser, any path of the file system by HTTP, a frame of any length. Here
a host must name the token of the URL (`drivers.canopen.remote_bus`), a browser's request is refused whatever it names,
nothing but the WebSocket is served, and every length is bounded. The library's own server never ends the connections
it holds either: here each is remembered, cut when the bridge closes, and its thread waited for. A host that dies in
the middle of a frame is no defect: the library's thread would print a traceback and leave its end of the bus open.
"""

from __future__ import annotations

import hmac
import logging
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from http import HTTPStatus
from typing import Any, Final, Self

import can
from can_remote import RemoteServer
from can_remote.server import ClientRequestHandler, RemoteServerProtocol
from can_remote.websocket import WebSocket, WebsocketClosed, get_accept_key

from drivers.canopen.remote_bus import forget_token, keep_token, new_token
from drivers.errors import BusDown
from hil.simulator.addresses import Address

LOGGER = logging.getLogger(__name__)

POLL_S = 0.05  # how often the accepting thread looks whether it should end [s]

HANDSHAKE_S: Final = 5.0
"""Time from a connection's first moment to its end of the handshake, HTTP and bus request together [s]."""

MOST_HOSTS: Final = 16  # connections at a time that have named the token

MOST_WAITING: Final = 64
"""Connections at a time that have not; one more ends the oldest of them, so that they keep no host out."""

LONGEST_FRAME_BYTES: Final = 4096  # of a WebSocket; a CAN frame in JSON has some 200

MOST_PERIODIC: Final = 64
SHORTEST_PERIOD_S: Final = 0.001
"""Frames that a host may have sent again and again by the server, and how often."""

BINARY, JSON = "can.binary+json.v1", "can.json.v1"
"""The library's two subprotocols; the first is the quick one."""

MESSAGE_TOO_BIG, POLICY_VIOLATION = 1009, 1008  # status codes of RFC 6455, 7.4.1


class _BoundedWebSocket(WebSocket):  # type: ignore[misc]  # the library carries no types
    """A server's end of a WebSocket that makes room for short frames only."""

    def _read_exactly(self, n: int) -> bytearray:
        if n > LONGEST_FRAME_BYTES:
            raise WebsocketClosed(MESSAGE_TOO_BIG, f"a frame of {n} bytes, expected at most {LONGEST_FRAME_BYTES}")
        read: bytearray = super()._read_exactly(n)
        return read


class _Connection(RemoteServerProtocol):  # type: ignore[misc]  # the library carries no types
    """One host, whose end of the virtual bus is closed however its connection ends.

    What a host asks of the bus is not heeded: it gets the served channel as it is.
    """

    def __init__(self, config: dict[str, Any], websocket: WebSocket, in_time: Callable[[], None]) -> None:
        super(RemoteServerProtocol, self).__init__(websocket)
        request = self.recv(HANDSHAKE_S)
        in_time()
        if not isinstance(request, dict) or request.get("type") != "bus_request":
            raise WebsocketClosed(POLICY_VIOLATION, "expected a bus_request first")
        self.config = config
        self.bus = can.Bus(**config)
        self.send_bus_response(self.bus.channel_info)
        self.running = True
        self._send_tasks: dict[int, Any] = {}
        self._send_thread = threading.Thread(target=self._send_to_client, daemon=True)

    def _send_to_client(self) -> None:
        try:
            super()._send_to_client()
        except OSError:
            LOGGER.info("a host ended its connection in the middle of a frame", exc_info=True)
        finally:
            self.bus.shutdown()

    def _receive_from_client(self) -> None:
        while self.running:
            try:
                event = self.recv()
            except WebsocketClosed as end:
                LOGGER.info("connection ended: %s", end)
                return
            if isinstance(event, can.Message):
                self.bus.send(_classic(event))
            elif isinstance(event, dict) and event.get("type") == "periodic_start":
                self._start(event["payload"])
            elif isinstance(event, dict) and event.get("type") == "periodic_stop":
                self._send_tasks.pop(event["payload"]).stop()

    def _start(self, asked: dict[str, Any]) -> None:
        message, period_s = _classic(can.Message(**asked["msg"])), float(asked["period"])
        known = self._send_tasks.get(message.arbitration_id)
        if known is not None:
            known.modify_data(message)
            return
        if len(self._send_tasks) >= MOST_PERIODIC or not period_s >= SHORTEST_PERIOD_S:
            raise ValueError(f"at most {MOST_PERIODIC} periodic frames, every {SHORTEST_PERIOD_S} s at most")
        task = self.bus.send_periodic(message, period_s, asked.get("duration"))
        self._send_tasks[message.arbitration_id] = task


def _classic(message: can.Message) -> can.Message:
    """Return a frame that a classic CAN bus can carry."""
    highest = 0x1FFFFFFF if message.is_extended_id else 0x7FF
    if message.is_fd or message.is_error_frame or not 0 <= message.arbitration_id <= highest or len(message.data) > 8:
        raise ValueError("expected a classic CAN frame of at most 8 bytes")
    return message


class _Handler(ClientRequestHandler):  # type: ignore[misc]  # the library carries no types
    """Meets a host: upgrades its HTTP request to a WebSocket (RFC 6455, 4.2.2) and serves it; nothing else."""

    timeout = HANDSHAKE_S

    def do_GET(self) -> None:  # noqa: N802 - the name http.server calls
        refusal = self._refusal()
        if refusal is None and not self.server.admit(self.request):
            refusal = HTTPStatus.SERVICE_UNAVAILABLE
        if refusal is not None:
            self.close_connection = True
            self.send_error(refusal)
            return
        self.start_websocket()

    def _refusal(self) -> HTTPStatus | None:
        """Say why a request is none of a host's."""
        if self.headers.get("Origin") is not None:  # a browser sends it, a host does not
            return HTTPStatus.FORBIDDEN
        if not hmac.compare_digest(self.path.strip("/").encode(), self.server.token.encode()):
            return HTTPStatus.FORBIDDEN
        if self.headers.get("Upgrade", "").lower() != "websocket" or "Sec-WebSocket-Key" not in self.headers:
            return HTTPStatus.UPGRADE_REQUIRED
        return None

    def start_websocket(self) -> None:
        protocol = BINARY if BINARY in self.headers.get("Sec-WebSocket-Protocol", "") else JSON
        self.send_response(HTTPStatus.SWITCHING_PROTOCOLS)
        self.send_header("Upgrade", "WebSocket")
        self.send_header("Connection", "Upgrade")
        self.send_header("Sec-WebSocket-Accept", get_accept_key(self.headers["Sec-WebSocket-Key"]))
        self.send_header("Sec-WebSocket-Protocol", protocol)
        self.end_headers()
        self.request.settimeout(None)
        self.close_connection = True
        in_time = partial(self.server.end_handshake, self.request)
        try:
            _Connection(self.server.config, _BoundedWebSocket(None, protocol, sock=self.request), in_time).run()
        except WebsocketClosed as end:
            LOGGER.info("connection ended: %s", end)


class _ClosableServer(RemoteServer):  # type: ignore[misc]  # the library carries no types
    """The library's server, with connections that can be ended."""

    daemon_threads = False  # server_close() then waits for the threads

    def __init__(self, address: Address, channel: str) -> None:
        self._connections: set[socket.socket] = set()
        self._hosts: set[socket.socket] = set()
        self._deadlines: dict[socket.socket, float] = {}  # of handshakes, the oldest first
        self._lock = threading.Lock()
        self.token = new_token()
        super().__init__(address.host, address.port, interface="virtual", channel=channel)
        self.RequestHandlerClass = _Handler

    def process_request(self, request: socket.socket, client_address: Any) -> None:
        with self._lock:
            waiting = [each for each in self._deadlines if each not in self._hosts]
            if len(waiting) >= MOST_WAITING:
                _cut(waiting[0])
                del self._deadlines[waiting[0]]
            self._connections.add(request)
            self._deadlines[request] = time.monotonic() + HANDSHAKE_S
        super().process_request(request, client_address)

    def admit(self, request: socket.socket) -> bool:
        """Count a connection that has named the token as a host's; False where there are enough."""
        with self._lock:
            if len(self._hosts) >= MOST_HOSTS:
                return False
            self._hosts.add(request)
            return True

    def end_handshake(self, request: socket.socket) -> None:
        """Take a handshake for done: the connection may last as long as it likes."""
        with self._lock:
            self._deadlines.pop(request, None)

    def service_actions(self) -> None:
        """End the handshakes that are over time; called by the accepting thread every `POLL_S`."""
        now = time.monotonic()
        with self._lock:
            for request in [request for request, deadline in self._deadlines.items() if deadline <= now]:
                _cut(request)
                del self._deadlines[request]

    def shutdown_request(self, request: socket.socket) -> None:
        with self._lock:
            self._connections.discard(request)
            self._hosts.discard(request)
            self._deadlines.pop(request, None)
        super().shutdown_request(request)

    def handle_error(self, request: socket.socket, client_address: Any) -> None:
        """Log a connection that broke: a host that dies takes its connection along, not the simulated rig."""
        LOGGER.info("connection from %s ended", client_address, exc_info=True)

    def cut_connections(self) -> None:
        """End every connection; the threads that serve them then return."""
        with self._lock:
            for connection in self._connections:
                _cut(connection)


def _cut(connection: socket.socket) -> None:
    """End a connection; the thread that serves it then returns."""
    with suppress(OSError):  # already ended by the other side, its thread is on the way out
        connection.shutdown(socket.SHUT_RDWR)


class CanBridge:
    """A virtual channel at a TCP address, from `__enter__` to `__exit__`."""

    def __init__(self, address: Address, channel: str) -> None:
        try:
            self._server = _ClosableServer(address, channel)
        except OSError as error:
            raise BusDown(
                f"simulated bus: can't serve at {address}: {error}. Choose a free port, or port 0."
            ) from error
        self._thread = threading.Thread(
            target=self._server.serve_forever, args=(POLL_S,), name="can-bridge", daemon=True
        )
        self.port = int(self._server.server_port)
        self.url = f"ws://{Address(address.host, self.port)}/{self._server.token}/"

    def __enter__(self) -> Self:
        try:
            keep_token(self.port, self._server.token)
        except OSError as error:  # whoever has the whole URL needs no file
            LOGGER.warning("the token of port %d can't be kept: %s", self.port, error)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._thread.join()
        self._server.cut_connections()
        self._server.server_close()
        forget_token(self.port, self._server.token)
