"""CAN frames over a WebSocket to a ``python-can-remote`` server, with every wait bounded; the token of a served bus.

The library's own client connects and shuts down without a time-out: a server that accepts and says nothing,
or stops before it says goodbye, would hang the program that has drives to disarm.

Every program of this machine, and every page in its browser, can reach a port of it, and who may read a served bus may
drive the simulated drives. It takes only those who name its token, as the path of its URL:
``ws://127.0.0.1:54701/TOKEN/``. The token is made anew for each server, and kept in a file of the user's own, so that a
rig file that names the port alone keeps working for that user.
"""

from __future__ import annotations

import os
import random
import secrets
import ssl
import sys
import time
from base64 import b64encode
from http import HTTPStatus
from http.client import HTTPConnection, HTTPException, HTTPSConnection
from pathlib import Path
from typing import Final
from urllib.parse import SplitResult, urlsplit

import can
from can_remote.client import DEFAULT_SSL_CONTEXT, RemoteBus, RemoteClientProtocol
from can_remote.protocol import RemoteError
from can_remote.websocket import WebSocket, WebsocketClosed, get_accept_key

TOKEN_BYTES: Final = 24

LOOPBACK: Final = frozenset({"127.0.0.1", "::1", "localhost"})

_SUBPROTOCOLS = ("can.binary+json.v1", "can.json.v1")
_TIMEOUT_S = 3.0


def new_token() -> str:
    """Draw a token; letters, digits, ``-`` and ``_``."""
    return secrets.token_urlsafe(TOKEN_BYTES)


def token_file(port: int) -> Path:
    """Name the file of a port's token, in the user's folder of sockets or, where there is none, of states."""
    base = os.environ.get("XDG_RUNTIME_DIR") or os.environ.get("XDG_STATE_HOME")
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA")
    return Path(base or Path.home() / ".local" / "state") / "hil" / f"bus-{port}.token"


def keep_token(port: int, token: str) -> None:
    """Keep the token of a server that is up; nobody else can read it."""
    path = token_file(port)
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    path.unlink(missing_ok=True)
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="ascii") as file:
        file.write(token)


def forget_token(port: int, token: str) -> None:
    """Remove the token of a server that is gone, unless the port has another one's by now."""
    if kept_token(port) == token:
        token_file(port).unlink(missing_ok=True)


def kept_token(port: int) -> str | None:
    """Return the token of the simulated bus on a port of this machine; None where there is none to read."""
    try:
        return token_file(port).read_text(encoding="ascii")
    except (OSError, ValueError):
        return None


class _BoundedWebSocket(WebSocket):  # type: ignore[misc]  # the library has no types
    """A client WebSocket whose handshake, reads and writes end after ``_TIMEOUT_S``."""

    def connect(
        self,
        protocols: tuple[str, ...],
        headers: dict[str, str] | None = None,
        ssl_context: ssl.SSLContext | None = None,
    ) -> None:
        address = urlsplit(self.url)
        secure = address.scheme == "wss"
        connection = (
            HTTPSConnection(address.netloc, timeout=_TIMEOUT_S, context=ssl_context)
            if secure
            else HTTPConnection(address.netloc, timeout=_TIMEOUT_S)
        )
        key = b64encode(random.randbytes(16)).decode()
        try:
            self.protocol = _handshake(connection, _path(address), key, protocols, headers or {})
        except BaseException:
            connection.close()
            raise
        self.socket = connection.sock
        self._ssl = secure


def _path(address: SplitResult) -> str:
    """Return the path to ask for: the URL's, or the token that this user's own server has kept for its port."""
    if address.path.strip("/") or address.hostname not in LOOPBACK or address.port is None:
        return address.path or "/"
    token = kept_token(address.port)
    return "/" if token is None else f"/{token}/"


def _handshake(
    connection: HTTPConnection, path: str, key: str, protocols: tuple[str, ...], headers: dict[str, str]
) -> str:
    """Upgrade the connection to a WebSocket (RFC 6455, 4.1); return the subprotocol the server chose."""
    upgrade = {
        "Upgrade": "WebSocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Key": key,
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Protocol": ",".join(protocols),
    }
    connection.request("GET", path, headers={**headers, **upgrade})
    answer = connection.getresponse()
    chosen = answer.getheader("Sec-WebSocket-Protocol", "")
    if answer.status == HTTPStatus.FORBIDDEN:
        raise HTTPException(
            "the server takes only hosts that name its token: give the whole URL that hil sim has printed"
        )
    if answer.status != 101 or answer.getheader("Sec-WebSocket-Accept") != get_accept_key(key):
        raise HTTPException(f"the server answered with HTTP status {answer.status}, not with a WebSocket")
    if chosen not in protocols:
        raise HTTPException(f"the server speaks {chosen or 'no subprotocol'!r}, not CAN frames")
    return chosen


class BoundedRemoteBus(RemoteBus):  # type: ignore[misc]  # the library has no types
    """``can_remote.RemoteBus`` that never waits for ever."""

    def __init__(self, url: str) -> None:
        websocket = _BoundedWebSocket(url, _SUBPROTOCOLS, ssl_context=DEFAULT_SSL_CONTEXT)
        self.socket = websocket.socket
        try:
            self.remote_protocol = RemoteClientProtocol({}, websocket)
        except (WebsocketClosed, OSError) as error:
            self.socket.close()
            raise RemoteError(f"the server opened no bus ({error})") from error
        except BaseException:
            self.socket.close()
            raise
        self.channel_info = url  # as the rig file has it; the server's own name of its bus is of no use to a person
        self.channel = url
        can.BusABC.__init__(self, url)

    def shutdown(self) -> None:
        """Say goodbye, wait for the answer no longer than ``_TIMEOUT_S``, close the socket."""
        if self._is_shutdown:
            return
        can.BusABC.shutdown(self)
        try:
            self._part()
        except (WebsocketClosed, OSError):
            pass  # the server has gone first: there is nobody to say goodbye to
        finally:
            self.socket.close()

    def _part(self) -> None:
        self.remote_protocol.close()
        deadline = time.monotonic() + _TIMEOUT_S
        while (left := deadline - time.monotonic()) > 0:
            try:
                self.remote_protocol.recv(left)
            except RemoteError:  # frames and complaints still under way are of no interest any more
                continue
