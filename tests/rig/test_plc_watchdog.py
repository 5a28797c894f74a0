"""The watchdog of the PLC, and limits of its that can not be."""

import asyncio
import math
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.canopen.can_link import CanLink
from drivers.plc.plc import Plc
from drivers.plc.register_map import load_register_map
from drivers.resources import data_file
from hil.errors import RunAborted
from hil.orders.operator import Talk
from hil.rig.build import open_devices
from hil.rig.experiments.base import Phase
from hil.rig.plc_loop import HostBeat
from hil.rig.plc_watch import MOST_OF_RATED, plc_limits
from hil.simulator.addresses import Address
from hil.simulator.plc_device import PlcSetup
from hil.simulator.rig_server import HOST_TIMEOUT_S, RigServer
from tests.commission.rigs import bench
from tests.commission.test_engine import person
from tests.rig.observer import assert_disarmed
from tests.rig.serving import Samples, changed, run_once, served, small_rig
from tests.rig.test_fitness import FIT


async def beat_once(at: Address) -> None:
    async with Plc(at.host, at.port, load_register_map(data_file("plc.toml"))) as plc:
        await plc.beat()


def lose_a_host(server: RigServer) -> None:
    """A host beats once and goes; simulated time advances until the PLC has withdrawn the permissive."""
    asyncio.run(beat_once(server.modbus))
    with CanLink.open(server.bus_url) as link:
        for _ in range(round(1.5 * HOST_TIMEOUT_S / 0.01)):
            link.sync()
    assert server.plc.values()["permissive"] is False


def test_a_run_after_a_dead_host() -> None:
    with served() as (server, rig):
        for _ in range(2):
            lose_a_host(server)
            assert run_once(rig, Samples()).recorded > 0


def test_the_host_beats_while_it_configures_and_arms() -> None:
    beats: set[int] = set()
    with served() as (server, rig), open_devices(rig) as devices:
        with HostBeat(devices.plc_loop, devices.plc) as beat:
            while len(beats) < 3:
                beats.add(count_of(server))
            beat.hand_over()
        last = count_of(server)
        devices.plc_loop.call(devices.plc.beat())
        assert count_of(server) == last + 1


def count_of(server: RigServer) -> int:
    return int(str(server.plc.values()["host_count"]))


def test_a_beat_that_fails_meanwhile_ends_the_run_before_a_torque() -> None:
    with served() as (_, rig), open_devices(rig) as devices:
        devices.plc.close()
        with HostBeat(devices.plc_loop, devices.plc) as beat, pytest.raises(RunAborted, match="host's beats, got: PLC"):
            beat.hand_over()


def test_a_host_whose_beats_stop_loses_the_permissive(monkeypatch: pytest.MonkeyPatch) -> None:
    """The cycle continues and reads the PLC, but its watchdog stands still, from the measured part on."""
    stopped: list[bool] = []
    beat = Plc.beat

    async def beat_until_stopped(plc: Plc) -> None:
        if not stopped:
            await beat(plc)

    def stop(phase: Phase, time_s: float) -> None:
        if phase is Phase.MEASURE:
            stopped.append(True)

    monkeypatch.setattr(Plc, "beat", beat_until_stopped)
    long = changed(small_rig(), {"experiments.reversal": {"duration_s": 2.0 * HOST_TIMEOUT_S}})
    with served(long) as (server, rig):
        with pytest.raises(RunAborted, match="permissive is withdrawn, expected present"):
            run_once(rig, Samples(), progress=stop, experiment="reversal")
        assert_disarmed(server.bus_url, 1, 2)
        assert server.plc.values()["permissive"] is False


RATED_NM, RPM = 600.0, 2.0 * math.pi / 60.0


@pytest.mark.parametrize(
    ("torque_nm", "believed"), [(450.0, True), (MOST_OF_RATED * RATED_NM, True), (4500.0, False), (1800.1, False)]
)
def test_a_torque_limit_beyond_three_times_rated_torque_is_not_believed(torque_nm: float, believed: bool) -> None:
    torque, _ = plc_limits(replace(FIT, torque_limit_nm=torque_nm), small_rig(), None)
    assert torque.believed is believed
    assert f"the PLC allows {torque_nm:,g} Nm" in torque.question
    assert "rated 600 Nm" in torque.question


@pytest.mark.parametrize("factor", [1.0, 1.0 / RPM])
@pytest.mark.parametrize("source", ["the drives", "the rig file"])
def test_a_speed_limit_in_another_unit_is_not_believed(source: str, factor: float) -> None:
    """320 rad/s, and the number of its revolutions per minute taken for rad/s."""
    limit_rad_s = 300.0
    rig = small_rig() if source == "the drives" else changed(small_rig(), {"guard": {"speed_limit_rad_s": limit_rad_s}})
    drives_rad_s = limit_rad_s if source == "the drives" else None
    _, speed = plc_limits(replace(FIT, speed_limit_rad_s=320.0 * factor), rig, drives_rad_s)
    assert speed.believed is (factor == 1.0)
    assert f"{source} 300 rad/s (2,865 rpm)" in speed.question


@pytest.mark.campaign
@pytest.mark.parametrize("torque_nm", [pytest.param(450.0, marks=pytest.mark.campaign), 4500.0])
def test_commissioning_asks_before_any_torque(torque_nm: float, tmp_path: Path) -> None:
    with bench(tmp_path) as rig:
        rig.server.plc._setup = PlcSetup(torque_limit_nm=torque_nm)
        believed = torque_nm == 450.0
        with pytest.raises(RunAborted, match="answer was no" if believed else "at most 1,800 Nm, 3 times rated torque"):
            rig.call("limits", talk=person("y", "n") if believed else Talk(None, True))
        if believed:
            assert rig.call("limits", talk=person("y", "yes")).steps["limits"].status.is_settled
