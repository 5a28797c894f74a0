"""A PLC that watches its host: after one that died, the next one beats first and is let in."""

import asyncio

import pytest

from drivers.canopen.can_link import CanLink
from drivers.plc.plc import Plc
from drivers.plc.register_map import load_register_map
from drivers.resources import data_file
from hil.errors import RunAborted
from hil.rig.build import open_devices
from hil.rig.plc_loop import HostBeat
from hil.simulator.addresses import Address
from hil.simulator.rig_server import HOST_TIMEOUT_S, RigServer
from tests.rig.serving import Samples, run_once, served


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
