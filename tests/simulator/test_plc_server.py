"""The simulated PLC on Modbus TCP: requests, roles, and answers that go wrong, to bare sockets and clients."""

import asyncio
import re
import socket
import threading
from collections.abc import Awaitable, Callable
from contextlib import ExitStack
from pathlib import Path

import pytest
from pymodbus.client import AsyncModbusTcpClient
from pymodbus.constants import ExcCodes

from drivers.errors import ConfigMismatch
from drivers.plc.modbus_security import Credentials
from drivers.plc.register import Access
from drivers.plc.register_map import load_register_map
from drivers.resources import data_file
from hil.simulator.faults import PlcAnswers, PlcFaults
from hil.simulator.plc_device import PlcDevice
from hil.simulator.plc_server import PlcSecurity, PlcServer

MAP = load_register_map(data_file("plc.toml"))

READ_PLC_COUNT = bytes.fromhex("0001 0000 0006 01 04 0009 0001")
"""MBAP header, unit 1, function 4: one input register from address 9."""

PLC_COUNT_0 = bytes.fromhex("0001 0000 0005 01 04 02 0000")
"""The answer: two bytes, 0."""


def ask(port: int, conversation: Callable[[AsyncModbusTcpClient], Awaitable[None]]) -> None:
    async def run() -> None:
        client = AsyncModbusTcpClient("127.0.0.1", port=port, timeout=30, retries=0, reconnect_delay=0)
        assert await client.connect()
        try:
            await conversation(client)
        finally:
            client.close()

    asyncio.run(run())


def test_words_stand_where_the_shipped_map_says() -> None:
    """Written out by hand, so that the map and its codec are not both wrong in the same way."""
    device = PlcDevice()
    device.step(0.03)

    async def conversation(client: AsyncModbusTcpClient) -> None:
        inputs = await client.read_input_registers(0, count=13)
        assert inputs.registers[:4] == [0x0048, 0x4944, 0x2024, 1]  # vendor (high word first), device, version
        assert inputs.registers[4:6] == [1, 0]  # series, open
        assert inputs.registers[6:8] == [0x0000, 0x43A0]  # 320.0 as IEEE 754: 43A00000, low word first
        assert inputs.registers[8:11] == [4500, 3, 0]  # 450 Nm in steps of 0.1, PLC cycles, host count
        assert (await client.read_discrete_inputs(0)).bits[0] is True
        assert (await client.read_coils(0)).bits[0] is False

    with PlcServer(device, MAP) as server:
        ask(server.port, conversation)


def test_single_and_multiple_writes_reach_the_device() -> None:
    device = PlcDevice()

    async def conversation(client: AsyncModbusTcpClient) -> None:
        assert not (await client.write_register(5, 77)).isError()
        assert not (await client.write_registers(2, [0x0000, 0x42F0])).isError()  # 120.0: 42F00000
        assert not (await client.write_coil(0, True)).isError()
        assert not (await client.write_register(1, 2)).isError()

    with PlcServer(device, MAP) as server:
        ask(server.port, conversation)
    values = device.values()
    assert values["prbs_seed"] == 77
    assert values["prbs_amplitude"] == 120.0
    assert values["prbs_enable"] is True
    assert values["drive_mode"] == "parallel"


@pytest.mark.parametrize(
    ("request_of", "code"),
    [
        (lambda client: client.read_input_registers(12, count=2), ExcCodes.ILLEGAL_ADDRESS),
        (lambda client: client.read_coils(0, count=2), ExcCodes.ILLEGAL_ADDRESS),
        (lambda client: client.write_register(7, 1), ExcCodes.ILLEGAL_ADDRESS),
        (lambda client: client.write_register(2, 1), ExcCodes.ILLEGAL_ADDRESS),  # half of a float32
        (lambda client: client.write_register(5, 0), ExcCodes.ILLEGAL_VALUE),
        (lambda client: client.write_register(1, 9), ExcCodes.ILLEGAL_VALUE),
        (lambda client: client.write_registers(2, [0, 0x7FC0]), ExcCodes.ILLEGAL_VALUE),  # NaN
        (lambda client: client.mask_write_register(address=5), ExcCodes.ILLEGAL_FUNCTION),
        (lambda client: client.readwrite_registers(read_count=1, values=[1]), ExcCodes.ILLEGAL_FUNCTION),
        (lambda client: client.read_coils(0, device_id=3), ExcCodes.GATEWAY_NO_RESPONSE),
        (lambda client: client.write_coil(0, True, device_id=3), ExcCodes.GATEWAY_NO_RESPONSE),
    ],
)
def test_what_can_t_be_done_has_its_exception_code(
    request_of: Callable[[AsyncModbusTcpClient], Awaitable[object]], code: ExcCodes
) -> None:
    device = PlcDevice()
    before = device.values()

    async def conversation(client: AsyncModbusTcpClient) -> None:
        answer = await request_of(client)
        assert getattr(answer, "exception_code", None) == code

    with PlcServer(device, MAP) as server:
        ask(server.port, conversation)
    assert device.values() == before


def test_a_read_only_holding_register_can_t_be_written(tmp_path: Path) -> None:
    text = data_file("plc.toml").read_text("utf-8")
    path = tmp_path / "map.toml"
    pattern = r'(\[registers.prbs_seed\].*?)access = "read_write"'
    path.write_text(re.sub(pattern, r'\1access = "read"', text, count=1, flags=re.DOTALL), "utf-8")

    async def conversation(client: AsyncModbusTcpClient) -> None:
        assert (await client.write_register(5, 7)).exception_code == ExcCodes.ILLEGAL_ADDRESS
        assert (await client.read_holding_registers(5)).registers == [1]

    with PlcServer(PlcDevice(), load_register_map(path)) as server:
        ask(server.port, conversation)


def test_two_clients_see_one_device() -> None:
    async def run(port: int) -> None:
        clients = [AsyncModbusTcpClient("127.0.0.1", port=port, reconnect_delay=0) for _ in range(2)]
        for client in clients:
            assert await client.connect()
        await clients[0].write_register(5, 321)
        assert (await clients[1].read_holding_registers(5)).registers == [321]
        for client in clients:
            client.close()

    with PlcServer(PlcDevice(), MAP) as server:
        asyncio.run(run(server.port))


def test_it_is_gone_when_closed_even_with_a_client_connected() -> None:
    with ExitStack() as served:
        server = served.enter_context(PlcServer(PlcDevice(), MAP))
        with socket.create_connection((server.host, server.port)) as client:
            client.settimeout(60.0)
            client.sendall(READ_PLC_COUNT)
            assert client.recv(64) == PLC_COUNT_0
            served.close()
            assert client.recv(1) == b""
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((server.host, server.port))
    assert "plc-server" not in [thread.name for thread in threading.enumerate()]


def test_a_map_with_a_register_the_plc_does_not_know_is_refused() -> None:
    more = {**MAP.registers, "oil_level": MAP["plc_count"]}
    with pytest.raises(ConfigMismatch, match="registers the simulated PLC knows, got oil_level"):
        with PlcServer(PlcDevice(), MAP.model_copy(update={"registers": more})):
            pass


def test_a_paused_plc_keeps_the_connection_and_says_nothing() -> None:
    with PlcServer(PlcDevice(), MAP) as server, socket.create_connection((server.host, server.port)) as client:
        client.settimeout(0.1)
        server.pause()
        client.sendall(READ_PLC_COUNT)
        with pytest.raises(TimeoutError):
            client.recv(1)
        server.resume()
        client.settimeout(5.0)
        client.sendall(READ_PLC_COUNT)
        assert client.recv(64) == PLC_COUNT_0


NO_FILES = Credentials(Path("ca"), Path("certificate"), Path("key"))
SECURITY = PlcSecurity(NO_FILES, {"viewer": Access.READ, "operator": Access.READ_WRITE})
READING, WRITING = (1, 2, 3, 4), (5, 6, 15, 16)
UNKNOWN = (0, 7, 22, 23, 43, 100, 255)


@pytest.mark.parametrize("function_code", READING)
def test_reading(function_code: int) -> None:
    assert SECURITY.allows("viewer", function_code)
    assert SECURITY.allows("operator", function_code)


@pytest.mark.parametrize("function_code", WRITING + UNKNOWN)
def test_everything_else_counts_as_writing(function_code: int) -> None:
    assert not SECURITY.allows("viewer", function_code)
    assert SECURITY.allows("operator", function_code)


@pytest.mark.parametrize("role", [None, "", "nobody", "Operator", "operator "])
@pytest.mark.parametrize("function_code", READING + WRITING)
def test_no_role_and_an_unknown_one_may_do_nothing(role: str | None, function_code: int) -> None:
    assert not SECURITY.allows(role, function_code)


READ_TWO = bytes.fromhex("0001 0000 0006 01 04 0002 0002")
TWO = bytes.fromhex("0001 0000 0007 01 04 04 2024 0001")
ONE = bytes.fromhex("0001 0000 0005 01 04 02 2024")
DEVICE_FAILURE = bytes.fromhex("0001 0000 0003 01 84 04")


def answer_of(answers: PlcAnswers, timeout_s: float) -> bytes:
    device = PlcDevice(faults=PlcFaults(answers_at_s=frozenset({(0.0, answers)})))
    with PlcServer(device, MAP) as server:
        with socket.create_connection((server.host, server.port), timeout=timeout_s) as client:
            client.sendall(READ_TWO)
            return client.recv(64)


@pytest.mark.parametrize(
    ("answers", "answer"),
    [
        (PlcAnswers.WELL, TWO),
        (PlcAnswers.EXCEPTION, DEVICE_FAILURE),
        (PlcAnswers.HALF, TWO[: len(TWO) // 2]),
        (PlcAnswers.TOO_FEW, ONE),
        (PlcAnswers.LATE, TWO),
        (PlcAnswers.WRONG_UNIT, TWO[:6] + b"\x81" + TWO[7:]),
        (PlcAnswers.WRONG_TRANSACTION, b"\x80" + TWO[1:]),
    ],
)
def test_what_comes_back(answers: PlcAnswers, answer: bytes) -> None:
    assert answer_of(answers, timeout_s=10.0) == answer


def test_a_reset_is_a_reset_and_no_end() -> None:
    with pytest.raises(ConnectionResetError):
        answer_of(PlcAnswers.RESET, timeout_s=10.0)
