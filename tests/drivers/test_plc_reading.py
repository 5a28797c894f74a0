"""What registers hold, and which values no vehicle has: misread numbers are refused where they are read."""

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import ExitStack

import pytest

from drivers.errors import BusDown, ConfigMismatch, DeviceTimeout, ProtocolViolation
from drivers.plc.named_registers import PLAUSIBLE, reading
from drivers.plc.plc import Plc
from drivers.plc.reader import Backoff, PlcReader
from drivers.plc.register import Register, WordOrder
from drivers.plc.register_map import USED, RegisterMap, load_register_map
from drivers.resources import data_file
from hil.simulator.faults import PlcAnswers, PlcFaults
from hil.simulator.plc_device import PlcDevice
from hil.simulator.plc_server import PlcServer
from tests.drivers.modbus_peers import free_port

MAP = load_register_map(data_file("plc.toml"))
HIGH, LOW = WordOrder.HIGH_WORD_FIRST, WordOrder.LOW_WORD_FIRST


def register(type_: str, unit: str, order: WordOrder | None, scale: float | None = None) -> Register:
    return Register.model_validate(
        {
            "kind": "input_register",
            "address": 0,
            "type": type_,
            "access": "read",
            "unit": unit,
            "description": "A register.",
            "word_order": None if order is None else order.value,
            "scale": scale,
        }
    )


@pytest.mark.parametrize(
    ("name", "type_", "unit", "scale", "value"),
    [
        ("torque_limit", "float32", "Nm", None, 350.0),
        ("torque_limit", "float32", "kNm", None, 0.35),
        ("torque_limit", "uint32", "Nm", 0.001, 350.0),
        ("torque_limit", "int32", "Nm", 0.1, 350.0),
        ("speed_limit", "float32", "1/min", None, 3200.0),
        ("speed_limit", "float32", "rad/s", None, 320.0),
        ("prbs_amplitude", "float32", "Nm", None, 120.5),
        ("prbs_torque", "float32", "Nm", None, 60.0),
        ("prbs_seed", "uint32", "1", None, 77),
        ("prbs_divider", "uint32", "1", None, 40),
        ("host_count_seen", "uint32", "1", None, 500),
    ],
)
@pytest.mark.parametrize("order", list(WordOrder))
def test_value_in_the_other_word_order_is_refused_with_what_it_would_be(
    name: str, type_: str, unit: str, scale: float | None, value: float, order: WordOrder
) -> None:
    there = register(type_, unit, order, scale)
    right = reading(name, there, there.encode(value))
    assert right.problem is None
    assert right.value == pytest.approx(value)
    assert right.unit == ("" if unit == "1" else unit)
    wrong = reading(name, there, there.encode(value)[::-1])
    other = HIGH if order is LOW else LOW
    assert wrong.problem is not None
    assert f"With word_order = '{other.value}' in the register map it would be {value:.7g} {unit}." in wrong.problem
    with pytest.raises(ProtocolViolation, match=rf"register {name} \(input_register 0\): expected 0, or "):
        wrong.required()


@pytest.mark.parametrize("name", sorted(PLAUSIBLE))
def test_zero_is_plausible_everywhere(name: str) -> None:
    unit = USED[name][1]
    there = register("uint32" if unit == "1" else "float32", unit, HIGH)
    assert reading(name, there, (0, 0)).problem is None


def test_limit_that_can_not_be_is_not_believed_in_a_run_either() -> None:
    """A speed limit of 1e-43 rad/s, or of 1e25, would hold nothing back, or everything."""

    async def run() -> None:
        with PlcServer(PlcDevice(faults=PlcFaults(swaps_floats=True)), MAP) as served:
            async with Plc("127.0.0.1", served.port, MAP, timeout_s=10.0) as plc:
                readings = {each.name: each for each in await plc.read_registers()}
                assert readings["speed_limit"].problem is not None
                assert readings["torque_limit"].problem is None
                with pytest.raises(ProtocolViolation, match=r"PLC at .*register speed_limit.*expected 0, or 0\.1 to"):
                    await plc.read_status()

    asyncio.run(run())


Sleep = Callable[[float], Awaitable[None]]


def reader(port: int, backoff: Backoff, sleep: Sleep, map_: RegisterMap = MAP, timeout_s: float = 10.0) -> PlcReader:
    return PlcReader(Plc("127.0.0.1", port, map_, timeout_s=timeout_s), backoff, sleep)


def test_pauses_double_up_to_the_longest() -> None:
    assert list(Backoff(0.5, 3.0, attempts=6).pauses_s()) == [0.5, 1.0, 2.0, 3.0, 3.0]
    assert list(Backoff(attempts=1).pauses_s()) == []


def test_a_plc_that_comes_back_is_read_again() -> None:
    """Gone at the first attempt and at the second, there at the third; then lost in between two reads."""
    port = free_port()
    pauses: list[float] = []

    async def run() -> None:
        with ExitStack() as served:

            async def sleep(pause_s: float) -> None:
                pauses.append(pause_s)
                if len(pauses) >= 2:
                    served.enter_context(PlcServer(PlcDevice(), MAP, port=port))

            async with reader(port, Backoff(0.5, 10.0, attempts=4), sleep) as plc:
                assert (await plc.read_status()).permissive
                served.close()
                assert (await plc.read_status()).permissive

    asyncio.run(run())
    assert pauses == [0.5, 1.0, 0.5]


@pytest.mark.parametrize(("answers", "error"), [(PlcAnswers.NOT, DeviceTimeout), (PlcAnswers.RESET, BusDown)])
def test_it_gives_up_with_the_last_reason(answers: PlcAnswers, error: type[Exception]) -> None:
    pauses: list[float] = []

    async def sleep(pause_s: float) -> None:
        pauses.append(pause_s)

    async def run() -> None:
        faults = PlcFaults(answers_at_s=frozenset({(0.0, answers)}))
        with PlcServer(PlcDevice(faults=faults), MAP) as served:
            async with reader(served.port, Backoff(0.5, 10.0, attempts=3), sleep, timeout_s=0.2) as plc:
                with pytest.raises(error, match="PLC at 127"):
                    await plc.read_status()

    asyncio.run(run())
    assert pauses == [0.5, 1.0]


def test_another_plc_is_no_reason_to_try_again() -> None:
    async def sleep(pause_s: float) -> None:
        raise AssertionError("tried again")

    async def run() -> None:
        other = MAP.model_copy(update={"identity": {**MAP.identity, "map_version": 7}})
        with PlcServer(PlcDevice(), MAP) as served:
            async with reader(served.port, Backoff(), sleep, other) as plc:
                with pytest.raises(ConfigMismatch, match="map_version is 1, expected 7"):
                    await plc.read_status()

    asyncio.run(run())
