"""The Modbus connection against peers that misbehave: each way has its own error, none is silent."""

import asyncio

import pytest

from drivers.errors import BusDown, DeviceFault, DeviceTimeout, ProtocolViolation
from drivers.plc.modbus_link import EXCEPTION_TEXT, ModbusLink
from drivers.plc.register import RegisterKind
from tests.drivers.modbus_peers import Answer, frame, free_port, peer

HOLDING, COIL = RegisterKind.HOLDING_REGISTER, RegisterKind.COIL
TIMEOUT_S = 0.1
"""For answers that do not come."""

PATIENCE_S = 60.0
"""For those that do, from a machine that may be busy."""


def read_from(
    answer: Answer, kind: RegisterKind = HOLDING, count: int = 2, timeout_s: float = PATIENCE_S
) -> tuple[int, ...]:
    async def run() -> tuple[int, ...]:
        async with peer(answer) as port:
            link = ModbusLink("127.0.0.1", port, 1, timeout_s)
            await link.open()
            try:
                return await link.read(kind, 5, count)
            finally:
                link.close()

    return asyncio.run(run())


def write_to(answer: Answer, kind: RegisterKind = HOLDING) -> None:
    async def run() -> None:
        async with peer(answer) as port:
            link = ModbusLink("127.0.0.1", port, 1, PATIENCE_S)
            await link.open()
            try:
                await link.write(kind, 5, (1, 0))
            finally:
                link.close()

    asyncio.run(run())


def test_words_arrive_in_the_order_of_addresses() -> None:
    assert read_from(lambda request: frame(request, b"\x03\x04\x12\x34\xab\xcd")) == (0x1234, 0xABCD)


def test_bits_arrive_least_significant_first() -> None:
    assert read_from(lambda request: frame(request, b"\x01\x01\x05"), COIL, 3) == (1, 0, 1)


@pytest.mark.parametrize("code", sorted(EXCEPTION_TEXT))
def test_an_exception_answer_is_raised_with_its_text(code: int) -> None:
    family = ProtocolViolation if code <= 3 else DeviceFault
    with pytest.raises(family, match=rf"PLC at .* holding_register.*exception {code} \(") as refusal:
        read_from(lambda request: frame(request, bytes([0x83, code])))
    assert EXCEPTION_TEXT[code] in str(refusal.value)


@pytest.mark.parametrize(
    ("pdu", "expected"),
    [
        (b"\x03\x02\x12\x34", "expected 2 values, got 1"),
        (b"\x03\x06\x00\x01\x00\x02\x00\x03", "expected 2 values, got 3"),
        (b"\x04\x04\x12\x34\xab\xcd", "expected function 3, got function 4"),
        (b"\x03\x09\x12\x34", "expected a Modbus answer, got bytes 03 09 12 34"),
        (b"\x55\x01", "expected a Modbus answer, got bytes 55 01"),
    ],
)
def test_a_wrong_answer_is_refused(pdu: bytes, expected: str) -> None:
    with pytest.raises(ProtocolViolation, match=expected):
        read_from(lambda request: frame(request, pdu))


def test_no_answer_is_a_timeout() -> None:
    with pytest.raises(DeviceTimeout, match=r"expected an answer within 0\.1 s, none came"):
        read_from(lambda request: b"", timeout_s=TIMEOUT_S)


WELL = b"\x03\x04\x12\x34\xab\xcd"


@pytest.mark.parametrize(
    ("answer", "got"),
    [
        (lambda request: frame(request, WELL, unit=9), "transaction id 1, unit id 9"),
        (lambda request: frame(request, WELL, transaction=4711), "transaction id 4711, unit id 1"),
        (lambda request: frame(request, WELL, transaction=0), "transaction id 0, unit id 1"),
        (lambda request: frame(request, b"\x83\x02", unit=255), "transaction id 1, unit id 255"),
        (lambda request: 2 * frame(request, WELL, transaction=4711), "transaction id 4711, unit id 1"),
    ],
)
def test_an_answer_with_other_identifiers_is_reported_as_such(answer: Answer, got: str) -> None:
    with pytest.raises(ProtocolViolation, match=rf"transaction id 1, unit id 1, got {got}"):
        read_from(answer, timeout_s=TIMEOUT_S)


def test_a_late_answer_is_not_taken_for_that_of_the_next_request_and_is_no_wrong_one() -> None:
    """The first request stays unanswered; its answer comes in the place of the second's."""
    requests: list[bytes] = []

    def answer(request: bytes) -> bytes:
        requests.append(request)
        return b"" if len(requests) == 1 else frame(requests[0], WELL)

    async def run() -> None:
        async with peer(answer) as port:
            link = ModbusLink("127.0.0.1", port, 1, TIMEOUT_S)
            await link.open()
            try:
                with pytest.raises(DeviceTimeout, match="none came"):
                    await link.read(HOLDING, 5, 2)
                with pytest.raises(DeviceTimeout, match="one to an earlier request came, too late"):
                    await link.read(HOLDING, 5, 2)
            finally:
                link.close()

    asyncio.run(run())


def test_a_lost_connection_is_not_a_timeout_and_ends_the_wait_at_once() -> None:
    """A wait to its end would take the hour, which no test is given."""

    async def run() -> None:
        async with peer(lambda request: None) as port:
            link = ModbusLink("127.0.0.1", port, 1, timeout_s=3600.0)
            await link.open()
            with pytest.raises(BusDown, match=r"the connection was lost.*\[plc\.security\]"):
                await link.read(HOLDING, 5, 2)
            assert not link.connected

    asyncio.run(run())


def test_a_confirmed_write_passes() -> None:
    write_to(lambda request: frame(request, b"\x10\x00\x05\x00\x02"))
    write_to(lambda request: frame(request, b"\x0f\x00\x05\x00\x02"), COIL)


@pytest.mark.parametrize("confirmed", [b"\x10\x00\x06\x00\x02", b"\x10\x00\x05\x00\x01"])
def test_a_write_confirmed_for_something_else_is_refused(confirmed: bytes) -> None:
    with pytest.raises(ProtocolViolation, match="expected address 5, count 2 confirmed, got address"):
        write_to(lambda request: frame(request, confirmed))


def test_no_server_is_a_bus_that_is_down() -> None:
    port = free_port()
    with pytest.raises(BusDown, match=f"PLC at 127.0.0.1:{port}.*expected a Modbus TCP server"):
        asyncio.run(ModbusLink("127.0.0.1", port, 1, TIMEOUT_S).open())


def test_nothing_is_sent_before_it_is_open_or_after_it_is_closed() -> None:
    async def run() -> None:
        async with peer(lambda request: frame(request, b"\x03\x02\x00\x01")) as port:
            link = ModbusLink("127.0.0.1", port, 1, TIMEOUT_S)
            with pytest.raises(BusDown, match="expected an open connection"):
                await link.read(HOLDING, 0, 1)
            await link.open()
            assert await link.read(HOLDING, 0, 1) == (1,)
            link.close()
            link.close()
            with pytest.raises(BusDown, match="expected an open connection"):
                await link.read(HOLDING, 0, 1)

    asyncio.run(run())
