"""A reader of the PLC's status that comes back after a loss, and gives up when it has tried enough."""

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack

import pytest

from drivers.errors import BusDown, ConfigMismatch, DeviceTimeout
from drivers.plc.plc import Plc
from drivers.plc.reader import Backoff, PlcReader
from drivers.plc.register_map import RegisterMap, load_register_map
from drivers.resources import data_file
from hil.simulator.faults import PlcFaults
from hil.simulator.plc_device import PlcDevice
from hil.simulator.plc_server import serve_plc
from tests.drivers.modbus_peers import free_port

MAP = load_register_map(data_file("plc.toml"))

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
        async with AsyncExitStack() as served:

            async def sleep(pause_s: float) -> None:
                pauses.append(pause_s)
                if len(pauses) >= 2:
                    await served.enter_async_context(serve_plc(PlcDevice(), MAP, port=port))

            async with reader(port, Backoff(0.5, 10.0, attempts=4), sleep) as plc:
                assert (await plc.read_status()).permissive
                await served.aclose()
                assert (await plc.read_status()).permissive

    asyncio.run(run())
    assert pauses == [0.5, 1.0, 0.5]


@pytest.mark.parametrize(
    ("faults", "error"), [(PlcFaults(hangs_at_s=0.0), DeviceTimeout), (PlcFaults(resets_at_s=0.0), BusDown)]
)
def test_it_gives_up_with_the_last_reason(faults: PlcFaults, error: type[Exception]) -> None:
    pauses: list[float] = []

    async def sleep(pause_s: float) -> None:
        pauses.append(pause_s)

    async def run() -> None:
        async with serve_plc(PlcDevice(faults=faults), MAP) as served:
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
        async with serve_plc(PlcDevice(), MAP) as served, reader(served.port, Backoff(), sleep, other) as plc:
            with pytest.raises(ConfigMismatch, match="map_version is 1, expected 7"):
                await plc.read_status()

    asyncio.run(run())
