"""The PLC driver against the simulated PLC on a real Modbus TCP connection."""

import asyncio
import re
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.errors import ConfigMismatch, DeviceTimeout, ProtocolViolation
from drivers.plc.plc import GENERATOR_OFF, Plc
from drivers.plc.register_map import RegisterMap, load_register_map
from drivers.plc.types import ClutchState, DriveMode, PrbsSettings, PrbsSource
from drivers.resources import data_file
from drivers.torque_guard import GuardedTorque, TorqueGuard, TorqueRequest
from hil.simulator.plc_device import PlcDevice, PlcSetup
from hil.simulator.plc_server import PlcServer
from tests.drivers.can_bench import FRESH, guard_limits

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


def allowed(amplitude_nm: float) -> tuple[GuardedTorque, GuardedTorque]:
    """A PRBS that a guard has let through, shared evenly."""
    guard = TorqueGuard(guard_limits(1e6))
    guard.enable()
    return guard.check(TorqueRequest(0.0, amplitude_nm / 2, 0.0, amplitude_nm / 2), 0, FRESH)


async def start(plc: Plc, settings: PrbsSettings = SETTINGS) -> PrbsSettings:
    return await plc.start_prbs(*allowed(settings.amplitude_nm), settings.clock_divider, settings.seed)


Talk = Callable[[Plc, PlcServer], Awaitable[None]]


def talk(
    device: PlcDevice,
    conversation: Talk,
    *,
    clock: Clock | None = None,
    map_: RegisterMap = MAP,
    timeout_s: float = 30.0,
) -> None:
    """Serve a device, connect, talk, disconnect."""

    async def run() -> None:
        with PlcServer(device, MAP) as served:
            plc = Plc("127.0.0.1", served.port, map_, timeout_s=timeout_s, clock_ns=clock or Clock())
            async with plc:
                await conversation(plc, served)

    asyncio.run(run())


def test_the_status_in_si_units() -> None:
    device = PlcDevice(PlcSetup(DriveMode.ELECTRIC, speed_limit_rad_s=210.25, torque_limit_nm=333.3))
    device.step(0.07)
    clock = Clock()
    clock.now_ns = 5 * MS

    async def conversation(plc: Plc, _: PlcServer) -> None:
        status = await plc.read_status()
        assert status.drive_mode is DriveMode.ELECTRIC
        assert status.clutch is ClutchState.OPEN
        assert status.permissive is True
        assert status.speed_limit_rad_s == 210.25
        assert status.torque_limit_nm == pytest.approx(333.3, abs=1e-9)
        assert status.plc_count == 7
        assert status.prbs == PrbsSettings(False, 0.0, 1, 1, PrbsSource.HOST)
        assert status.prbs_torque_nm == 0.0
        assert status.t_ns == 5 * MS
        assert status.age_ns(7 * MS) == 2 * MS

    talk(device, conversation, clock=clock)


def test_prbs_settings_arrive_and_the_generator_runs() -> None:
    device = PlcDevice()

    async def conversation(plc: Plc, _: PlcServer) -> None:
        assert await start(plc) == SETTINGS
        status = await plc.read_status()
        assert status.prbs == SETTINGS
        assert status.prbs_torque_nm == device.prbs_torque_nm
        assert abs(status.prbs_torque_nm) == 60.5
        assert await plc.stop_prbs() == GENERATOR_OFF
        status = await plc.read_status()
        assert status.prbs == GENERATOR_OFF
        assert status.prbs_torque_nm == 0.0

    talk(device, conversation)


@pytest.mark.parametrize("change", [{"clock_divider": 0}, {"seed": 0}, {"seed": 1024}, {"amplitude_nm": -1.0}])
def test_a_setting_the_plc_refuses_is_raised(change: dict[str, int]) -> None:
    async def conversation(plc: Plc, _: PlcServer) -> None:
        with pytest.raises(ProtocolViolation, match="illegal data value"):
            await start(plc, replace(SETTINGS, **change))
        assert not (await plc.read_status()).prbs.enabled

    talk(PlcDevice(), conversation)


class StoppedPlc(PlcDevice):
    """A PLC whose Modbus stack answers while its program stands still: no beat is seen."""

    __slots__ = ()

    def values(self) -> dict[str, bool | int | float | str]:
        return {**super().values(), "host_count_seen": 999}


def test_a_plc_that_does_not_see_the_beats_is_raised_when_the_time_is_up() -> None:
    clock = Clock()

    async def conversation(plc: Plc, _: PlcServer) -> None:
        await plc.beat()
        clock.now_ns = 500 * MS
        await plc.beat()
        clock.now_ns = 501 * MS
        with pytest.raises(DeviceTimeout, match=r"expected beat 1 seen by the PLC within 0\.5 s, it has seen 999"):
            await plc.beat()

    talk(StoppedPlc(), conversation, clock=clock)


def test_the_time_of_a_beat_counts_from_the_last_that_was_seen() -> None:
    """On a clock that has run for long: a sum of two times in place of their difference would be over at once."""
    clock = Clock()
    clock.now_ns = 1000 * 1000 * MS

    async def conversation(plc: Plc, _: PlcServer) -> None:
        await plc.beat()
        clock.now_ns += 500 * MS
        await plc.beat()

    talk(StoppedPlc(), conversation, clock=clock)


class PermitsLater(PlcDevice):
    """A PLC that gives its permissive back some beats after its host's first."""

    __slots__ = ("looks",)

    def __init__(self) -> None:
        super().__init__()
        self.looks = 0

    def values(self) -> dict[str, bool | int | float | str]:
        self.looks += 1
        return {**super().values(), "permissive": self.looks > 6}


def test_a_greeting_waits_for_the_permissive_and_no_longer_than_its_time() -> None:
    async def waits(plc: Plc, _: PlcServer) -> None:
        assert (await plc.greet()).permissive

    async def gives_up(plc: Plc, _: PlcServer) -> None:
        assert not (await plc.greet()).permissive

    device = PermitsLater()
    talk(device, waits)
    device.looks = -1_000_000
    talk(device, gives_up, clock=ImpatientClock())


def test_a_plc_that_hangs_is_a_timeout_and_can_come_back() -> None:
    async def conversation(plc: Plc, served: PlcServer) -> None:
        served.pause()
        with pytest.raises(DeviceTimeout, match=r"none came"):
            await plc.read_status()
        served.resume()
        assert (await plc.read_status()).permissive

    talk(PlcDevice(), conversation, timeout_s=0.5)


@pytest.mark.parametrize("name", sorted(MAP.identity))
def test_another_identity_is_refused(name: str) -> None:
    other = MAP.model_copy(update={"identity": {**MAP.identity, name: 7}})

    async def conversation(plc: Plc, _: PlcServer) -> None:
        raise AssertionError("connected to another PLC")

    with pytest.raises(ConfigMismatch, match=f"{name} is {MAP.identity[name]}, expected 7"):
        talk(PlcDevice(), conversation, map_=other)


def test_words_that_mean_nothing_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "map.toml"
    path.write_text(re.sub(r"series = 1, parallel = 2, electric = 3", "series = 4", MAP_TEXT, count=1), "utf-8")

    async def conversation(plc: Plc, _: PlcServer) -> None:
        with pytest.raises(ProtocolViolation, match=r"expected one of \{'series': 4\}, got 1"):
            await plc.read_status()

    talk(PlcDevice(), conversation, map_=load_register_map(path))


MAP_TEXT = data_file("plc.toml").read_text("utf-8")


@pytest.mark.parametrize(
    ("name", "unit", "expected"),
    [
        ("speed_limit", "km/h", "rad/s or 1/min or rpm or 1/s"),
        ("torque_limit", "lbf ft", "Nm or kNm"),
        ("prbs_amplitude", "%", "Nm or kNm"),
        ("plc_count", "s", "1"),
        ("permissive", "Nm", "1"),
    ],
)
def test_a_unit_the_driver_can_t_work_with_is_refused(name: str, unit: str, expected: str) -> None:
    registers = {**MAP.registers, name: MAP[name].model_copy(update={"unit": unit})}
    with pytest.raises(ConfigMismatch, match=rf"register map .*: {name}: expected unit {expected}, got {unit}\."):
        Plc("127.0.0.1", 1, MAP.model_copy(update={"registers": registers}))
