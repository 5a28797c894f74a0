"""The simulated PLC on Modbus TCP: registers from the device, roles by certificate, and answers that go wrong."""

from __future__ import annotations

import asyncio
import logging
import socket
import struct
from asyncio.trsock import TransportSocket
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from threading import Thread
from typing import Any, Final, Self

from pymodbus.constants import ExcCodes
from pymodbus.exceptions import NoSuchIdException
from pymodbus.pdu import ExceptionResponse, ModbusPDU
from pymodbus.pdu.register_message import ReadHoldingRegistersResponse, ReadInputRegistersResponse
from pymodbus.server import ModbusTcpServer
from pymodbus.server.requesthandler import ServerRequestHandler
from pymodbus.simulator import DataType, SimData, SimDevice
from pymodbus.simulator.simcore import SimCore
from pymodbus.transport import CommParams, CommType

from drivers.errors import BusDown, ConfigMismatch, ProtocolViolation
from drivers.plc.modbus_security import Credentials, role_of, server_context
from drivers.plc.register import Access, Register, RegisterKind, Value, ValueType, WordOrder
from drivers.plc.register_map import RegisterMap
from hil.simulator.faults import LATE_BY_S, PlcAnswers
from hil.simulator.plc_device import PlcDevice, ValueRefusedError

KIND: Final = {
    1: RegisterKind.COIL,
    2: RegisterKind.DISCRETE_INPUT,
    3: RegisterKind.HOLDING_REGISTER,
    4: RegisterKind.INPUT_REGISTER,
    5: RegisterKind.COIL,
    6: RegisterKind.HOLDING_REGISTER,
    15: RegisterKind.COIL,
    16: RegisterKind.HOLDING_REGISTER,
}
"""What each function code works on; Modbus Application Protocol V1.1b3, section 6."""

READ_CODES: Final = frozenset({1, 2, 3, 4})
"""Function codes that only read; Modbus Application Protocol V1.1b3, section 6. All others count as writing."""

REGISTERS: Final = (ReadHoldingRegistersResponse, ReadInputRegistersResponse)
"""Answers that can be a register short."""

NO_LINGER: Final = struct.pack("ii", 1, 0)  # value of SO_LINGER: closing such a socket sends RST and not FIN

SETTLE_TURNS: Final = 5
"""Turns of the event loop; asyncio takes three from accepting a connection to telling its protocol."""


class PlcRegisters(SimCore):
    """pymodbus's view of the device: the two methods its server calls, for exactly the addresses of the map."""

    def __init__(self, device: PlcDevice, register_map: RegisterMap) -> None:
        super().__init__(SimDevice(0, SimData(0, values=0, datatype=DataType.REGISTERS)))
        if unknown := sorted(set(register_map.registers) - set(device.values())):
            raise ConfigMismatch(
                f"register map {register_map.name!r}: expected registers the simulated PLC knows, got "
                f"{', '.join(unknown)}. Use the shipped plc.toml with the simulated PLC."
            )
        self._device = device
        self._map = register_map

    async def async_getValues(  # noqa: N802 - pymodbus's name
        self, device_id: int, func_code: int, address: int, count: int = 1
    ) -> list[int] | list[bool] | ExcCodes:
        """Answer a read, or say why not."""
        self._require_device(device_id)
        kind = KIND.get(func_code)
        if kind is None:
            return ExcCodes.ILLEGAL_FUNCTION
        image = self._image(kind)
        if any(each not in image for each in range(address, address + count)):
            return ExcCodes.ILLEGAL_ADDRESS
        words = [image[each] for each in range(address, address + count)]
        return [bool(word) for word in words] if kind.is_bit else words

    async def async_setValues(  # noqa: N802 - pymodbus's name
        self, device_id: int, func_code: int, address: int, values: Sequence[int] | Sequence[bool]
    ) -> ExcCodes | None:
        """Take a write, or say why not."""
        self._require_device(device_id)
        kind = KIND.get(func_code)
        if kind is None:
            return ExcCodes.ILLEGAL_FUNCTION
        names = self._written(kind, address, len(values))
        if names is None:
            return ExcCodes.ILLEGAL_ADDRESS
        try:
            self._device.write({name: self._decoded(name, address, values) for name in names})
        except (ProtocolViolation, ValueRefusedError):
            return ExcCodes.ILLEGAL_VALUE
        return None

    def _require_device(self, device_id: int) -> None:
        if device_id != self._map.device_id:
            raise NoSuchIdException(f"expected device id {self._map.device_id}, got {device_id}")

    def _image(self, kind: RegisterKind) -> dict[int, int]:
        """Put every register of a kind into words, by address."""
        values = self._device.values()
        return {
            register.address + offset: word
            for name, register in self._map.registers.items()
            if register.kind is kind
            for offset, word in enumerate(self._ordered(register).encode(values[name]))
        }

    def _ordered(self, register: Register) -> Register:
        """Give a register as this PLC has it: a fault of its own may have the words of floats the other way round."""
        if register.type is not ValueType.FLOAT32 or not self._device.swaps_floats:
            return register
        other = next(each for each in WordOrder if each is not register.word_order)
        return register.model_copy(update={"word_order": other})

    def _written(self, kind: RegisterKind, address: int, count: int) -> list[str] | None:
        """Name the registers that make up a range; None unless it is writable registers from end to end."""
        inside = {
            name: register
            for name, register in self._map.registers.items()
            if register.kind is kind
            and register.access is Access.READ_WRITE
            and address <= register.address
            and register.end <= address + count
        }
        covered = sum(register.size for register in inside.values())
        return list(inside) if covered == count else None

    def _decoded(self, name: str, address: int, values: Sequence[int] | Sequence[bool]) -> Value:
        register = self._map[name]
        offset = register.address - address
        return self._ordered(register).decode([int(value) for value in values[offset : offset + register.size]])


@dataclass(frozen=True, slots=True)
class PlcSecurity:
    """The PLC's own certificate, and what each role may do."""

    credentials: Credentials  # What the PLC shows, and the authority that must have signed a client's certificate
    roles: Mapping[str, Access] = field(default_factory=dict)  # What each role may do

    def allows(self, role: str | None, function_code: int) -> bool:
        """Whether a client of this role, None for no role, may send a request of this function code."""
        access = None if role is None else self.roles.get(role)
        if access is Access.READ:
            return function_code in READ_CODES
        return access is Access.READ_WRITE


class PlcTcpServer(ModbusTcpServer):
    """pymodbus's server for one PLC, with TLS where its security is given."""

    def __init__(
        self,
        registers: PlcRegisters,  # What it answers from
        host: str,  # Address to listen on
        port: int,  # Address to listen on
        answers: Callable[[], PlcAnswers],  # How the PLC answers at the moment of asking
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
    """One connection."""

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
            case PlcAnswers.NOT:  # a program that hangs does not do what it is asked either
                return
            case PlcAnswers.EXCEPTION:
                self._send_exception(request, ExcCodes.DEVICE_FAILURE)
                return
            case PlcAnswers.RESET:
                self._reset()
                return
            case PlcAnswers.LATE:
                await asyncio.sleep(LATE_BY_S)
                self.last_pdu, self.last_addr = request, sender  # another may have come meanwhile
        await super().handle_request()  # type: ignore[no-untyped-call]

    def server_send(self, pdu: ModbusPDU, addr: Any) -> None:
        """Send an answer, one register short if that is how the PLC answers."""
        if self._plc.answers() is PlcAnswers.TOO_FEW and isinstance(pdu, REGISTERS):
            pdu.registers = pdu.registers[:-1]
        super().server_send(pdu, addr)  # type: ignore[no-untyped-call]

    def _pass_packet(self, sending: bool, packet: bytes) -> bytes:
        """Stand in every packet's way (pymodbus's ``trace_packet``)."""
        if sending and self._plc.answers() is PlcAnswers.NOT:
            return b""
        if sending and self._plc.answers() is PlcAnswers.HALF:
            return packet[: len(packet) // 2]
        if sending and self._plc.answers() is PlcAnswers.WRONG_UNIT:
            return packet[:6] + bytes((packet[6] ^ 0x80,)) + packet[7:]
        if sending and self._plc.answers() is PlcAnswers.WRONG_TRANSACTION:
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


logging.getLogger("pymodbus").addHandler(logging.NullHandler())  # else it logs to standard error by itself


async def _close(server: PlcTcpServer, sockets: Sequence[TransportSocket]) -> None:
    """Stop listening and drop every connection, also one that is being accepted just now.

    Such a connection would stay open for ever: until asyncio has informed pymodbus of it, closing the server does
    not reach it. So accepting ends first, and what is under way comes to its end before the server closes.
    """
    for listening in sockets:
        asyncio.get_running_loop().remove_reader(listening.fileno())
    await _settle()
    await server.shutdown()  # type: ignore[no-untyped-call]
    await _settle()


async def _settle() -> None:
    for _ in range(SETTLE_TURNS):
        await asyncio.sleep(0)


class PlcServer:
    """A simulated PLC served by a thread of its own, from `__enter__` to `__exit__`."""

    def __init__(
        self,
        device: PlcDevice,
        register_map: RegisterMap,
        host: str = "127.0.0.1",
        port: int = 0,
        security: PlcSecurity | None = None,
    ) -> None:
        self.host = host
        self._device = device
        self._map = register_map
        self._asked_port = port
        self._security = security
        self._paused = False
        self._port: Future[int] = Future()
        self._thread = Thread(target=self._run, name="plc-server", daemon=True)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stop: asyncio.Event | None = None

    @property
    def port(self) -> int:
        """Port it listens on; known once it is started."""
        return self._port.result()

    def __enter__(self) -> Self:
        """Start the thread and wait until it listens."""
        self._thread.start()
        try:
            self._port.result()
        except BaseException:
            self._thread.join()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """Stop listening, drop the connections and end the thread."""
        if self._loop is not None and self._stop is not None and self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stop.set)
            self._thread.join()

    def pause(self) -> None:
        """Keep the connections up and answer nothing: the PLC that hangs."""
        self._paused = True

    def resume(self) -> None:
        """Answer again, after `pause`."""
        self._paused = False

    def _answers(self) -> PlcAnswers:
        """Tell how the PLC answers now: as its faults say, or not at all while it is paused."""
        return PlcAnswers.NOT if self._paused else self._device.answers

    def _run(self) -> None:
        try:
            asyncio.run(self._serve())
        except BaseException as error:  # carried to the caller of __enter__(), which raises it
            if self._port.done():
                raise
            self._port.set_exception(error)

    async def _serve(self) -> None:
        self._loop, self._stop = asyncio.get_running_loop(), asyncio.Event()
        registers = PlcRegisters(self._device, self._map)
        server = PlcTcpServer(registers, self.host, self._asked_port, self._answers, self._security)
        if not await server.listen():
            raise BusDown(
                f"simulated PLC: expected to listen on {self.host}:{self._asked_port}, can't. Is another program using "
                "the port? Choose another in [plc] of the rig file, or 0 for a free one."
            )
        sockets: Sequence[TransportSocket] = server.transport.sockets  # type: ignore[attr-defined]
        self._port.set_result(sockets[0].getsockname()[1])
        try:
            await self._stop.wait()
        finally:
            await _close(server, sockets)
