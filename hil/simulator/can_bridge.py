"""Serve a virtual CAN channel to other processes: python-can-remote's WebSocket server, made closable.

The library's own server never ends the connections it holds: closing it would leave threads and sockets
behind. Here each connection is remembered, cut when the bridge closes, and its thread waited for. A host that
dies in the middle of a frame is no defect either: the library's thread would print a traceback and leave its
end of the virtual bus open.
"""

from __future__ import annotations

import logging
import socket
import threading
from contextlib import suppress
from types import TracebackType
from typing import Any, Self

from can_remote import RemoteServer
from can_remote.server import ClientRequestHandler, RemoteServerProtocol
from can_remote.websocket import WebSocket, get_accept_key

from drivers.errors import BusDown
from hil.simulator.loopback import Address

LOGGER = logging.getLogger(__name__)

POLL_S = 0.05
"""How often the accepting thread looks whether it should end [s]."""


BINARY, JSON = "can.binary+json.v1", "can.json.v1"
"""The library's two subprotocols; the first is the quick one."""


class _Connection(RemoteServerProtocol):  # type: ignore[misc]  # the library carries no types
    """One host, whose end of the virtual bus is closed however its connection ends."""

    def _send_to_client(self) -> None:
        try:
            super()._send_to_client()
        except OSError:
            LOGGER.info("a host ended its connection in the middle of a frame", exc_info=True)
        finally:
            self.bus.shutdown()


class _Handler(ClientRequestHandler):  # type: ignore[misc]  # the library carries no types
    """Meets a host: upgrades its HTTP request to a WebSocket (RFC 6455, 4.2.2) and serves it."""

    def start_websocket(self) -> None:
        protocol = BINARY if BINARY in self.headers.get("Sec-WebSocket-Protocol", "") else JSON
        self.send_response(101)
        self.send_header("Upgrade", "WebSocket")
        self.send_header("Connection", "Upgrade")
        self.send_header("Sec-WebSocket-Accept", get_accept_key(self.headers["Sec-WebSocket-Key"]))
        self.send_header("Sec-WebSocket-Protocol", protocol)
        self.end_headers()
        _Connection(self.server.config, WebSocket(None, protocol, sock=self.request)).run()


class _ClosableServer(RemoteServer):  # type: ignore[misc]  # the library carries no types
    """The library's server, with connections that can be ended."""

    daemon_threads = False  # server_close() then waits for the threads

    def __init__(self, address: Address, channel: str) -> None:
        self._connections: set[socket.socket] = set()
        self._lock = threading.Lock()
        super().__init__(address.host, address.port, interface="virtual", channel=channel)
        self.RequestHandlerClass = _Handler

    def process_request(self, request: socket.socket, client_address: Any) -> None:
        with self._lock:
            self._connections.add(request)
        super().process_request(request, client_address)

    def shutdown_request(self, request: socket.socket) -> None:
        with self._lock:
            self._connections.discard(request)
        super().shutdown_request(request)

    def handle_error(self, request: socket.socket, client_address: Any) -> None:
        """Log a connection that broke: a host that dies takes its connection along, not the simulated rig."""
        LOGGER.info("connection from %s ended", client_address, exc_info=True)

    def cut_connections(self) -> None:
        """End every connection; the threads that serve them then return."""
        with self._lock:
            for connection in self._connections:
                with suppress(OSError):  # already ended by the other side, its thread is on the way out
                    connection.shutdown(socket.SHUT_RDWR)


class CanBridge:
    """A virtual channel at a TCP address, from `__enter__` to `__exit__`.

    Parameters
    ----------
    address
        Where to serve; port 0 takes a free one.
    channel
        Name of python-can's virtual channel in this process.

    Raises
    ------
    BusDown
        If the address can't be served at, for example because the port is taken.
    """

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
        self.url = f"ws://{Address(address.host, self._server.server_port)}/"

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._server.shutdown()
        self._thread.join()
        self._server.cut_connections()
        self._server.server_close()
