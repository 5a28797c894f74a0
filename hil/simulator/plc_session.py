"""The simulated PLC's end of each connection: the client's role, and the ways in which an answer can go wrong.

pymodbus's own handler answers the requests. What stands here comes before it (a role that does not allow the
request, a PLC that fails) and after it (an answer that is late, cut short, or never leaves).
"""

from __future__ import annotations

import asyncio
import socket
import struct
from collections.abc import Callable
from typing import Any, Final

from pymodbus.constants import ExcCodes
from pymodbus.pdu import ExceptionResponse, ModbusPDU
from pymodbus.pdu.register_message import ReadHoldingRegistersResponse, ReadInputRegistersResponse
from pymodbus.server import ModbusTcpServer
from pymodbus.server.requesthandler import ServerRequestHandler
from pymodbus.simulator import DataType, SimData, SimDevice
from pymodbus.transport import CommParams, CommType

from drivers.plc.modbus_security import role_of, server_context
from hil.simulator.plc_access import PlcSecurity
from hil.simulator.plc_answers import LATE_BY_S, Answers
from hil.simulator.plc_registers import PlcRegisters

REGISTERS: Final = (ReadHoldingRegistersResponse, ReadInputRegistersResponse)
"""Answers that can be a register short."""

NO_LINGER: Final = struct.pack("ii", 1, 0)
"""Value of SO_LINGER: closing such a socket sends RST and not FIN."""


class PlcTcpServer(ModbusTcpServer):
    """pymodbus's server for one PLC, with TLS where its security is given.

    Parameters
    ----------
    registers : PlcRegisters
        What it answers from.
    host, port
        Address to listen on.
    answers : callable
        How the PLC answers at the moment of asking.
    security : PlcSecurity or None
        Its certificate and what roles may do; None for plain Modbus TCP, where everybody may do everything.

    Raises
    ------
    ConfigMismatch
        If the files of its security can't be used.
    """

    def __init__(
        self,
        registers: PlcRegisters,
        host: str,
        port: int,
        answers: Callable[[], Answers],
        security: PlcSecurity | None,
    ) -> None:
        if security is not None:
            self.tls_setup = CommParams(  # where pymodbus's own constructor looks for it
                comm_type=CommType.TLS,
                comm_name="server_listener",
                reconnect_delay=0.0,
                sslctx=server_context(security.credentials),
            )
        placeholder = SimDevice(0, SimData(0, values=0, datatype=DataType.REGISTERS))
        super().__init__(placeholder, address=(host, port))
        self.context = registers
        self.answers = answers
        self.security = security

    def callback_new_connection(self) -> PlcSession:
        """Serve one more client."""
        return PlcSession(self)


class PlcSession(ServerRequestHandler):
    """One connection.

    Parameters
    ----------
    plc : PlcTcpServer
        Whose it is.
    """

    def __init__(self, plc: PlcTcpServer) -> None:
        super().__init__(plc, self._pass_packet, None, None)  # type: ignore[no-untyped-call]
        self._plc = plc
        self._role: str | None = None

    def callback_connected(self) -> None:
        """Take the role from the client's certificate; TLS has verified it by now."""
        super().callback_connected()
        channel = self.transport.get_extra_info("ssl_object")
        if channel is not None:
            self._role = role_of(channel.getpeercert(binary_form=True))

    def close(self, reconnect: bool = False) -> None:
        """Disconnect; over TLS with a word of goodbye, but without waiting for one."""
        channel: asyncio.Transport | None = self.transport  # type: ignore[assignment]
        super().close(reconnect)
        if channel is not None and channel.get_extra_info("ssl_object") is not None:
            channel.abort()

    async def handle_request(self) -> None:
        """Answer a request, or say why not."""
        request, sender = self.last_pdu, self.last_addr
        if request is None:
            return
        if self._plc.security is not None and not self._plc.security.allows(self._role, request.function_code):
            self._send_exception(request, ExcCodes.ILLEGAL_FUNCTION)
            return
        match self._plc.answers():
            case Answers.NOT:  # a program that hangs does not do what it is asked either
                return
            case Answers.EXCEPTION:
                self._send_exception(request, ExcCodes.DEVICE_FAILURE)
                return
            case Answers.RESET:
                self._reset()
                return
            case Answers.LATE:
                await asyncio.sleep(LATE_BY_S)
                self.last_pdu, self.last_addr = request, sender  # another may have come meanwhile
        await super().handle_request()  # type: ignore[no-untyped-call]

    def server_send(self, pdu: ModbusPDU, addr: Any) -> None:
        """Send an answer, one register short if that is how the PLC answers."""
        if self._plc.answers() is Answers.TOO_FEW and isinstance(pdu, REGISTERS):
            pdu.registers = pdu.registers[:-1]
        super().server_send(pdu, addr)  # type: ignore[no-untyped-call]

    def _pass_packet(self, sending: bool, packet: bytes) -> bytes:
        """Stand in every packet's way (pymodbus's ``trace_packet``)."""
        if sending and self._plc.answers() is Answers.NOT:
            return b""
        if sending and self._plc.answers() is Answers.HALF:
            return packet[: len(packet) // 2]
        if sending and self._plc.answers() is Answers.WRONG_UNIT:
            return packet[:6] + bytes((packet[6] ^ 0x80,)) + packet[7:]
        if sending and self._plc.answers() is Answers.WRONG_TRANSACTION:
            return bytes((packet[0] ^ 0x80,)) + packet[1:]
        return packet

    def _send_exception(self, request: ModbusPDU, code: ExcCodes) -> None:
        answer = ExceptionResponse(request.function_code, code, device_id=request.dev_id)
        answer.transaction_id = request.transaction_id
        self.server_send(answer, self.last_addr)

    def _reset(self) -> None:
        channel = self.transport
        channel.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, NO_LINGER)
        channel.abort()  # type: ignore[attr-defined]
