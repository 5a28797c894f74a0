"""The PLC driver against the simulated PLC on a real Modbus TCP connection."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest

from drivers.errors import (
    BusDown,
    ConfigMismatch,
    DeviceFault,
    DeviceTimeout,
    ProtocolViolation,
)
from drivers.plc import Plc
from drivers.plc_types import ClutchState, DriveMode, PlcWatchdog, PrbsSettings, PrbsSource
from drivers.register_map import RegisterMap, load_register_map
from drivers.resources import data_file
from hil.simulator.plc_device import PlcDevice, PlcFaults, PlcSetup
from hil.simulator.plc_server import ServedPlc, serve_plc

MAP = load_register_map(data_file("plc.toml"))
SETTINGS = PrbsSettings(True, 60.5, 3, 77, PrbsSource.PLC)
MS = 1_000_000


class Clock:
    """A clock that a test winds on by hand."""

    def __init__(self) -> None:
        self.now_ns = 0

    def __call__(self) -> int:
        return self.now_ns


class ImpatientClock(Clock):
    """A clock on which every look takes 30 ms."""

    def __call__(self) -> int:
        self.now_ns += 30 * MS
        return self.now_ns


Talk = Callable[[Plc, ServedPlc], Awaitable[None]]


def talk(device: PlcDevice, conversation: Talk, *, clock: Clock | None = None, map_: RegisterMap = MAP) -> None:
    """Serve a device, connect, talk, disconnect."""

    async def run() -> None:
        async with serve_plc(device, MAP) as served:
            plc = Plc(
                "127.0.0.1",
                served.port,
                map_,
                timeout_s=0.2,
                mode_timeout_s=0.05,
                clock_ns=clock or Clock(),
            )
            async with plc:
                await conversation(plc, served)

    asyncio.run(run())


def test_the_status_in_si_units() -> None:
    device = PlcDevice(PlcSetup(DriveMode.ELECTRIC, speed_limit_rad_s=210.25, torque_limit_nm=333.3))
    device.step(0.07)
    clock = Clock()
    clock.now_ns = 5 * MS

    async def conversation(plc: Plc, _: ServedPlc) -> None:
        status = await plc.read_status()
        assert status.drive_mode is DriveMode.ELECTRIC
        assert status.clutch is ClutchState.OPEN
        assert status.permissive is True
        assert status.speed_limit_rad_s == 210.25
        assert status.torque_limit_nm == pytest.approx(333.3, abs=1e-9)
        assert status.watchdog == PlcWatchdog(plc_count=7, host_count_seen=0)
        assert status.prbs == PrbsSettings(False, 0.0, 1, 1, PrbsSource.HOST)
        assert status.t_ns == 5 * MS

    talk(device, conversation, clock=clock)


def test_prbs_settings_arrive_and_the_generator_runs() -> None:
    device = PlcDevice()

    async def conversation(plc: Plc, _: ServedPlc) -> None:
        await plc.write_prbs(SETTINGS)
        assert (await plc.read_status()).prbs == SETTINGS
        assert abs(device.prbs_torque_nm) == 60.5
        off = PrbsSettings(False, 10.0, 1, 5, PrbsSource.HOST)
        await plc.write_prbs(off)
        assert (await plc.read_status()).prbs == off
        assert device.prbs_torque_nm == 0.0

    talk(device, conversation)


def test_a_setting_that_does_not_fit_its_register_changes_nothing() -> None:
    async def conversation(plc: Plc, _: ServedPlc) -> None:
        await plc.write_prbs(SETTINGS)
        with pytest.raises(ConfigMismatch, match="expected a number that fits uint16, came 70000"):
            await plc.write_prbs(PrbsSettings(False, 1.0, 70000, 1, PrbsSource.HOST))
        assert (await plc.read_status()).prbs == SETTINGS

    talk(PlcDevice(), conversation)


@pytest.mark.parametrize(("divider", "seed", "amplitude_nm"), [(0, 1, 1.0), (1, 0, 1.0), (1, 1024, 1.0), (1, 1, -1.0)])
def test_a_setting_the_plc_refuses_is_raised(divider: int, seed: int, amplitude_nm: float) -> None:
    async def conversation(plc: Plc, _: ServedPlc) -> None:
        with pytest.raises(ProtocolViolation, match="illegal data value"):
            await plc.write_prbs(PrbsSettings(True, amplitude_nm, divider, seed, PrbsSource.PLC))
        assert not (await plc.read_status()).prbs.enabled

    talk(PlcDevice(), conversation)


class LimitingPlc(PlcDevice):
    """A PLC whose program quietly limits the amplitude to 50 Nm."""

    __slots__ = ()

    def values(self) -> dict[str, bool | int | float | str]:
        values = super().values()
        return {**values, "prbs_amplitude": min(float(values["prbs_amplitude"]), 50.0)}


def test_a_setting_the_plc_quietly_changes_is_raised() -> None:
    async def conversation(plc: Plc, _: ServedPlc) -> None:
        with pytest.raises(ProtocolViolation, match=r"prbs_amplitude.*expected to read back .* as written, came"):
            await plc.write_prbs(SETTINGS)

    talk(LimitingPlc(), conversation)


def test_a_drive_mode_is_confirmed_by_the_status() -> None:
    async def conversation(plc: Plc, _: ServedPlc) -> None:
        for mode, clutch in (
            (DriveMode.PARALLEL, ClutchState.CLOSED),
            (DriveMode.ELECTRIC, ClutchState.OPEN),
            (DriveMode.SERIES, ClutchState.OPEN),
        ):
            await plc.request_drive_mode(mode)
            status = await plc.read_status()
            assert (status.drive_mode, status.clutch) == (mode, clutch)

    talk(PlcDevice(), conversation)


def test_a_drive_mode_that_is_refused_is_raised() -> None:
    faults = PlcFaults(refused_modes=frozenset({DriveMode.SERIES}))

    async def conversation(plc: Plc, _: ServedPlc) -> None:
        with pytest.raises(DeviceFault, match=r"drive mode is parallel after 0\.05 s, expected series"):
            await plc.request_drive_mode(DriveMode.SERIES)

    talk(PlcDevice(PlcSetup(DriveMode.PARALLEL), faults), conversation, clock=ImpatientClock())


def test_what_changes_in_simulated_time_is_seen() -> None:
    device = PlcDevice(faults=PlcFaults(clutch_closes_at_s=0.5, permissive_withdrawn_at_s=1.0))

    async def conversation(plc: Plc, _: ServedPlc) -> None:
        seen = []
        for _step in range(3):
            status = await plc.read_status()
            seen.append((status.clutch, status.permissive))
            device.step(0.5)
        assert seen == [
            (ClutchState.OPEN, True),
            (ClutchState.CLOSED, True),
            (ClutchState.CLOSED, False),
        ]

    talk(device, conversation)


def test_beats_are_counted_and_seen() -> None:
    async def conversation(plc: Plc, _: ServedPlc) -> None:
        for count in range(3):
            await plc.beat()
            assert (await plc.read_status()).watchdog.host_count_seen == count

    talk(PlcDevice(), conversation)


class StoppedPlc(PlcDevice):
    """A PLC whose Modbus stack answers while its program stands still: no beat is seen."""

    __slots__ = ()

    def values(self) -> dict[str, bool | int | float | str]:
        return {**super().values(), "host_count_seen": 999}


def test_a_plc_that_does_not_see_the_beats_is_raised_when_the_time_is_up() -> None:
    clock = Clock()

    async def conversation(plc: Plc, _: ServedPlc) -> None:
        await plc.beat()
        clock.now_ns = 500 * MS
        await plc.beat()
        clock.now_ns = 501 * MS
        with pytest.raises(DeviceTimeout, match=r"expected beat 1 seen by the PLC within 0\.5 s, it has seen 999"):
            await plc.beat()

    talk(StoppedPlc(), conversation, clock=clock)


def test_a_plc_that_hangs_is_a_timeout_and_can_come_back() -> None:
    async def conversation(plc: Plc, served: ServedPlc) -> None:
        served.pause()
        with pytest.raises(DeviceTimeout, match=r"none came"):
            await plc.read_status()
        served.resume()
        assert (await plc.read_status()).permissive

    talk(PlcDevice(), conversation)


def test_a_plc_that_hangs_while_connecting_leaves_nothing_open() -> None:
    async def run() -> None:
        async with serve_plc(PlcDevice(), MAP) as served:
            served.pause()
            plc = Plc("127.0.0.1", served.port, MAP, timeout_s=0.05)
            with pytest.raises(DeviceTimeout):
                await plc.connect()
            with pytest.raises(BusDown, match="expected an open connection"):
                await plc.read_status()

    asyncio.run(run())


@pytest.mark.parametrize("name", sorted(MAP.identity))
def test_another_identity_is_refused(name: str) -> None:
    other = MAP.model_copy(update={"identity": {**MAP.identity, name: 7}})

    async def conversation(plc: Plc, _: ServedPlc) -> None:
        raise AssertionError("connected to another PLC")

    with pytest.raises(ConfigMismatch, match=f"{name} is {MAP.identity[name]}, expected 7"):
        talk(PlcDevice(), conversation, map_=other)


def test_another_device_id_is_refused() -> None:
    other = MAP.model_copy(update={"device_id": 9})

    async def conversation(plc: Plc, _: ServedPlc) -> None:
        raise AssertionError("connected to another device id")

    with pytest.raises(DeviceFault, match="no device of this id"):
        talk(PlcDevice(), conversation, map_=other)


def test_words_that_mean_nothing_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "map.toml"
    path.write_text(re.sub(r"series = 1, parallel = 2, electric = 3", "series = 4", MAP_TEXT, count=1), "utf-8")

    async def conversation(plc: Plc, _: ServedPlc) -> None:
        with pytest.raises(ProtocolViolation, match=r"expected one of \{'series': 4\}, came 1"):
            await plc.read_status()

    talk(PlcDevice(), conversation, map_=load_register_map(path))


MAP_TEXT = data_file("plc.toml").read_text("utf-8")


def test_a_map_without_what_the_driver_needs_is_refused() -> None:
    less = {name: entry for name, entry in MAP.registers.items() if name != "clutch"}
    with pytest.raises(ConfigMismatch, match="expected a register clutch, there is none"):
        Plc("127.0.0.1", 1, MAP.model_copy(update={"registers": less}))
