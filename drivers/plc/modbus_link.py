"""A Modbus TCP connection that answers or raises: pymodbus's asyncio client, wrapped and not trusted.

What is done about pymodbus 3.16.1 here:

- a failed connection and a lost answer come back as values or as one catch-all exception: they are distinguished
  here, into `BusDown`, `DeviceTimeout` and `ProtocolViolation`;
- it does not count the registers of an answer: they are counted here;
- an answer it can't decode raises in the event loop, where nobody can catch it: `_Decoder` turns it into a
  value;
- it retries and reconnects behind the caller's back: both are switched off, a lost PLC must be seen;
- it does not say why there is no connection, and has no name of the server to check: `drivers.plc.modbus_dial`
  connects for it;
- it passes over an answer of another transaction or unit: `drivers.plc.modbus_dial` keeps which ones came;
- it logs to standard error where logging is not configured: a `NullHandler` ends that.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Sequence
from functools import partial
from typing import Final

from pymodbus.constants import ExcCodes
from pymodbus.exceptions import ModbusException
from pymodbus.pdu import DecodePDU, ExceptionResponse, ModbusPDU

from drivers.errors import BusDown, DeviceFault, DeviceTimeout, DriverError, ProtocolViolation
from drivers.plc.modbus_dial import AnswerIds, Dial, MbapFramer
from drivers.plc.modbus_security import ClientSecurity, own_role
from drivers.plc.register import RegisterKind

logging.getLogger("pymodbus").addHandler(logging.NullHandler())

EXCEPTION_TEXT: Final[dict[int, str]] = {
    ExcCodes.ILLEGAL_FUNCTION: "illegal function: the PLC does not know this request",
    ExcCodes.ILLEGAL_ADDRESS: "illegal data address: the PLC has no such register, or it can't be written",
    ExcCodes.ILLEGAL_VALUE: "illegal data value: the PLC does not accept this value",
    ExcCodes.DEVICE_FAILURE: "server device failure: the PLC could not do it",
    ExcCodes.ACKNOWLEDGE: "acknowledge: the PLC needs long for it",
    ExcCodes.DEVICE_BUSY: "server device busy: the PLC is busy with something else",
    ExcCodes.MEMORY_PARITY_ERROR: "memory parity error in the PLC",
    ExcCodes.GATEWAY_PATH_UNAVIABLE: "gateway path unavailable: the gateway is misconfigured or overloaded",
    ExcCodes.GATEWAY_NO_RESPONSE: "gateway target failed to respond: no device of this id behind the gateway",
}
"""Exception codes; Modbus Application Protocol V1.1b3, section 7."""

OUR_REQUEST: Final = (ExcCodes.ILLEGAL_FUNCTION, ExcCodes.ILLEGAL_ADDRESS, ExcCodes.ILLEGAL_VALUE)
"""Codes that say map and PLC disagree; all others are trouble inside the PLC."""


READ_CODE: Final = {
    RegisterKind.COIL: 1,
    RegisterKind.DISCRETE_INPUT: 2,
    RegisterKind.HOLDING_REGISTER: 3,
    RegisterKind.INPUT_REGISTER: 4,
}
"""Function codes that read; ibid., section 6."""

WRITE_CODE: Final = {RegisterKind.COIL: 15, RegisterKind.HOLDING_REGISTER: 16}
"""Function codes that write several; ibid., 6.11 and 6.12."""


class _Undecodable(ModbusPDU):
    """Stands for an answer that is no Modbus PDU."""

    def __init__(self, frame: bytes) -> None:
        super().__init__()
        self.frame = frame


class _Decoder(DecodePDU):
    """Gives an `_Undecodable` where pymodbus would raise inside the event loop."""

    def decode(self, frame: bytes) -> ModbusPDU:
        return super().decode(frame) or _Undecodable(frame)


class ModbusLink:
    """One connection to one Modbus TCP server, for one device id; it carries one request at a time."""

    def __init__(
        self, host: str, port: int, device_id: int, timeout_s: float, security: ClientSecurity | None = None
    ) -> None:
        self._host = host
        self._port = port
        self._device_id = device_id
        self._timeout_s = timeout_s
        self._security = security
        self._dial: Dial | None = None
        self._turn = asyncio.Lock()

    @property
    def place(self) -> str:
        """Where this link leads, for messages."""
        return f"PLC at {self._host}:{self._port} (device id {self._device_id})"

    @property
    def connected(self) -> bool:
        """Whether there is a connection; one that was lost is none."""
        return self._dial is not None and self._dial.client.connected

    async def open(self) -> None:
        """Connect anew; a connection that is open is closed first."""
        self.close()
        dial = Dial(self._host, self._port, self._timeout_s, self._security, self.place)
        dial.client.ctx.framer = MbapFramer(_Decoder(False))
        await dial.open()
        self._dial = dial

    def close(self) -> None:
        """Disconnect; safe to call when not connected."""
        if self._dial is not None:
            self._dial.close()
        self._dial = None

    async def read(self, kind: RegisterKind, address: int, count: int) -> tuple[int, ...]:
        """Read ``count`` words, or bits as 0 and 1, from ``address`` on."""
        dial = self._connected()
        requests = {
            RegisterKind.COIL: dial.client.read_coils,
            RegisterKind.DISCRETE_INPUT: dial.client.read_discrete_inputs,
            RegisterKind.HOLDING_REGISTER: dial.client.read_holding_registers,
            RegisterKind.INPUT_REGISTER: dial.client.read_input_registers,
        }
        what = f"reading {count} {kind.value}(s) from address {address}"
        request = partial(requests[kind], address, count=count, device_id=self._device_id)
        answer = await self._answer(dial, what, request, READ_CODE[kind])
        got = answer.bits if kind.is_bit else answer.registers
        expected = (count + 7) // 8 * 8 if kind.is_bit else count  # bits travel in whole bytes
        if len(got) != expected:
            raise self._wrong_answer(what, f"{expected} values", f"{len(got)}")
        return tuple(int(value) for value in got[:count])

    async def write(self, kind: RegisterKind, address: int, words: Sequence[int]) -> None:
        """Write words, or bits as 0 and 1, from ``address`` on."""
        dial = self._connected()
        what = f"writing {list(words)} to {kind.value} {address}"
        if kind is RegisterKind.COIL:
            bits = [bool(word) for word in words]
            request = partial(dial.client.write_coils, address, bits, device_id=self._device_id)
        elif kind is RegisterKind.HOLDING_REGISTER:
            request = partial(dial.client.write_registers, address, list(words), device_id=self._device_id)
        else:
            raise self._wrong_answer(what, "a kind that Modbus can write", kind.value)
        answer = await self._answer(dial, what, request, WRITE_CODE[kind])
        if (answer.address, answer.count) != (address, len(words)):
            got = f"address {answer.address}, count {answer.count}"
            raise self._wrong_answer(what, f"address {address}, count {len(words)} confirmed", got)

    def _connected(self) -> Dial:
        if self._dial is None or not self._dial.client.connected:
            raise BusDown(
                f"{self.place}: expected an open connection, there is none. Connect first; if it was lost, "
                "check the network and that the PLC runs."
            )
        return self._dial

    async def _answer(
        self, dial: Dial, what: str, request: Callable[[], Awaitable[ModbusPDU]], function_code: int
    ) -> ModbusPDU:
        """Wait for the requests before, ask, wait for the answer and see that it is one."""
        async with self._turn:
            return await self._answer_to(dial, what, request, function_code)

    async def _answer_to(
        self, dial: Dial, what: str, request: Callable[[], Awaitable[ModbusPDU]], function_code: int
    ) -> ModbusPDU:
        framer = _framer(dial)
        framer.begin()
        try:
            with dial.asking():
                answer = await request()
        except ModbusException as cause:  # its one way to say: nothing came
            raise self._foreign_answer(dial, what) or self._no_answer(dial, what) from cause
        dial.answered = True
        if answer.transaction_id != dial.client.ctx.request_transaction_id:  # pymodbus lets a 0 pass
            raise self._wrong_answer(what, str(self._expected(dial)), str(framer.got[-1]))
        if isinstance(answer, _Undecodable):
            raise self._wrong_answer(what, "a Modbus answer", f"bytes {answer.frame.hex(' ')}")
        if isinstance(answer, ExceptionResponse):
            raise self._refused(what, answer.exception_code)
        if answer.function_code != function_code:
            raise self._wrong_answer(what, f"function {function_code}", f"function {answer.function_code}")
        return answer

    def _expected(self, dial: Dial) -> AnswerIds:
        return AnswerIds(dial.client.ctx.request_transaction_id, self._device_id)

    def _foreign_answer(self, dial: Dial, what: str) -> ProtocolViolation | None:
        """Tell of answers that were none to this request; late ones, to requests before it, are no fault of theirs."""
        expected = self._expected(dial)
        foreign = [each for each in _framer(dial).got if not self._is_late(each, expected)]
        return self._wrong_answer(what, f"an answer with {expected}", str(foreign[0])) if foreign else None

    def _is_late(self, got: AnswerIds, expected: AnswerIds) -> bool:
        return got.unit == expected.unit and 0 < got.transaction < expected.transaction

    def _no_answer(self, dial: Dial, what: str) -> DriverError:
        if dial.client.connected:
            part = dial.client.ctx.recv_buffer
            got = "one to an earlier request came, too late" if _framer(dial).got else "none came"
            if part:
                got = f"only {len(part)} bytes came that are no whole one ({part[:8].hex(' ')} ...)"
            return DeviceTimeout(
                f"{self.place}: {what}: expected an answer within {self._timeout_s:g} s, {got}. "
                "Check that the PLC's program runs and that device_id in the register map is its own."
            )
        return dial.loss() or BusDown(
            f"{self.place}: {what}: expected an answer, the connection was lost. Check the network, that the PLC "
            "runs, and whether it wants TLS: then it needs [plc.security] in the rig file."
        )

    def _refused(self, what: str, code: int) -> DriverError:
        text = EXCEPTION_TEXT.get(code, "a code Modbus does not define")
        family = ProtocolViolation if code in OUR_REQUEST else DeviceFault
        cure = "Compare the register map with" if code in OUR_REQUEST else "Look at the diagnosis of"
        if self._security is not None and code == ExcCodes.ILLEGAL_FUNCTION:
            role = own_role(self._security.credentials)
            text += f", or not from a client certificate {'without a role' if role is None else f'of role {role!r}'}"
            cure = "Use a certificate with the role it takes, or compare the register map with"
        return family(
            f"{self.place}: {what}: expected it to be done, got exception {code} ({text}). {cure} the PLC's program."
        )

    def _wrong_answer(self, what: str, expected: str, got: str) -> ProtocolViolation:
        return ProtocolViolation(
            f"{self.place}: {what}: expected {expected}, got {got}. "
            "Check that a PLC with this register map is at this address."
        )


def _framer(dial: Dial) -> MbapFramer:
    framer = dial.client.ctx.framer
    if not isinstance(framer, MbapFramer):
        raise TypeError(f"expected the framer this module gave the client, got {framer!r}")
    return framer
