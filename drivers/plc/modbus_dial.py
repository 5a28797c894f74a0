"""Connect pymodbus's client ourselves: with TLS where that is asked for, and with a reason where it fails.

pymodbus 3.16.1 turns every failure to connect into one False, has no name of the server to check, and lets a
request wait for its whole time-out when the connection is lost meanwhile. All three are fixed here, through the
two hooks of its transport: what makes the connection, and what is reported of its end.

An answer whose transaction or unit identifier is not the request's is skipped by pymodbus with a line in its log, and
its user learns that none came. `MbapFramer` keeps which ones came, so that the wait can end with the right cause.
"""

from __future__ import annotations

import asyncio
import ssl
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

from pymodbus.client import AsyncModbusTcpClient
from pymodbus.exceptions import ConnectionException
from pymodbus.framer import FramerSocket
from pymodbus.pdu import DecodePDU

from drivers.errors import BusDown, DriverError
from drivers.plc.modbus_security import ClientSecurity, client_context, tls_failure

NO_RECONNECT: Final = 0  # pymodbus would reconnect behind the caller's back: a lost PLC must be seen

HANDSHAKE_S: Final = 5.0
"""Least time for connecting with TLS [s]: a small PLC computes for a second or two on a handshake, and once only."""


@dataclass(frozen=True, slots=True)
class AnswerIds:
    """Identifiers in the MBAP header of an answer (Modbus Messaging on TCP/IP V1.0b, 3.1.3)."""

    transaction: int  # transaction identifier of the request
    unit: int  # unit identifier of the request

    def __str__(self) -> str:
        return f"transaction id {self.transaction}, unit id {self.unit}"


class MbapFramer(FramerSocket):
    """A framer that keeps the identifiers of the answers that came."""

    def __init__(self, decoder: DecodePDU) -> None:
        super().__init__(decoder)
        self.got: list[AnswerIds] = []

    def begin(self) -> None:
        """Forget what came: another request is sent."""
        self.got.clear()

    def decode(self, data: bytes) -> tuple[int, int, int, bytes]:
        """Take a frame apart: length, unit, transaction, PDU; length 0 where it is none, or not all of one."""
        length, unit, transaction, pdu = super().decode(data)
        if length:
            self.got.append(AnswerIds(transaction, unit))
        return length, unit, transaction, pdu


class Dial:
    """One connection, made once."""

    def __init__(self, host: str, port: int, timeout_s: float, security: ClientSecurity | None, place: str) -> None:
        self._host = host
        self._port = port
        self._timeout_s = timeout_s
        self._place = place
        self._context = None if security is None else client_context(security.credentials)
        self._server_name = None if security is None else security.server_name or host
        self._connecting_s = timeout_s if security is None else max(timeout_s, HANDSHAKE_S)
        self._cause: Exception | None = None
        self._asking = 0
        self.answered = False
        self.client = AsyncModbusTcpClient(host, port=port, timeout=timeout_s, retries=0, reconnect_delay=NO_RECONNECT)
        self.client.ctx.call_create = self._connect
        self.client.ctx.callback_disconnected = self._lost  # type: ignore[method-assign]

    async def open(self) -> None:
        """Connect within the time allowed; DeviceTimeout or BusDown with the reason if that fails."""
        params = self.client.ctx.comm_params  # one time-out for both is all that pymodbus has
        params.timeout_connect = self._connecting_s
        if not await self.client.connect():
            self.client.close()
            raise await self._not_connected()
        params.timeout_connect = self._timeout_s

    def close(self) -> None:
        """Disconnect; over TLS with a word of goodbye, but without waiting for one."""
        transport: asyncio.Transport | None = self.client.ctx.transport  # type: ignore[assignment]
        self.client.close()
        if self._context is not None and transport is not None:
            transport.abort()

    @contextmanager
    def asking(self) -> Iterator[None]:
        """Wait for an answer in this block: the loss of the connection ends the wait at once."""
        self._asking += 1
        try:
            yield
        finally:
            self._asking -= 1

    def loss(self) -> DriverError | None:
        """Say why the connection went, if that is TLS's doing; TLS 1.3 refuses a client only after the handshake."""
        is_tls = isinstance(self._cause, ssl.SSLError) or (self._context is not None and not self.answered)
        return tls_failure(self._place, self._cause or ConnectionError()) if is_tls else None

    async def _connect(self) -> tuple[asyncio.BaseTransport, asyncio.BaseProtocol]:
        try:
            return await asyncio.get_running_loop().create_connection(
                self.client.ctx.handle_new_connection,
                self._host,
                self._port,
                ssl=self._context,
                server_hostname=self._server_name,
            )
        except OSError as cause:
            self._cause = cause
            raise

    def _lost(self, exc: Exception | None) -> None:
        self._cause = exc
        waiting = self.client.ctx.response_future
        if self._asking and not waiting.done():
            waiting.set_exception(ConnectionException("connection lost"))

    async def _not_connected(self) -> DriverError:
        if self._context is not None and await self._listens():
            return tls_failure(self._place, self._cause)
        return BusDown(
            f"{self._place}: expected a Modbus TCP server, no connection within {self._connecting_s:g} s. "
            "Check [plc] host and port of the rig file, the network, and that the PLC runs."
        )

    async def _listens(self) -> bool:
        """Whether anything takes a connection there at all."""
        try:
            _, writer = await asyncio.wait_for(asyncio.open_connection(self._host, self._port), self._connecting_s)
        except OSError:
            return False
        writer.close()
        return True
