"""A simulated drive that misses its host's commands: in simulated time and in real time, at the end without a frame."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import pytest

from drivers.canopen.can_link import CanLink
from drivers.errors import DeviceFault
from drivers.inverter.cia402 import PowerState
from drivers.inverter.inverter import Inverter
from hil.simulator.plant import RigidPlant
from hil.simulator.simulated_rig import SimulatedRig
from hil.simulator.stopping import NS_PER_MS, RpdoDeadline
from tests.drivers.can_bench import M1, M2, SIMULATED_M1, SIMULATED_M2, Bench, guarded, new_channel, virtual_bus

DEADLINE_MS = 100
SETTINGS = replace(M1, rpdo_deadline_ms=DEADLINE_MS)


@contextmanager
def driven(real_time: bool = False) -> Iterator[Bench]:
    """Both drives in operation, m1 at 120 Nm."""
    channel = new_channel()
    pair = (SIMULATED_M1, SIMULATED_M2)
    with (
        SimulatedRig(virtual_bus(channel), RigidPlant(100.0, 0.5), pair, real_time=real_time) as rig,
        CanLink.open(f"virtual:{channel}") as link,
    ):
        made = Bench(channel, rig, link, Inverter(link, SETTINGS), Inverter(link, M2))
        for inverter in (made.m1, made.m2):
            inverter.configure()
        made.m1.arm()
        made.cycle(guarded(120.0))
        yield made


def test_a_deadline_runs_from_the_first_rpdo_and_is_missed_once() -> None:
    deadline = RpdoDeadline(DEADLINE_MS)
    assert not deadline.missed(10**12)
    deadline.received(0)
    assert not deadline.missed(DEADLINE_MS * NS_PER_MS)
    assert deadline.missed(DEADLINE_MS * NS_PER_MS + 1)
    assert not deadline.missed(10**12)
    deadline.received(10**12)
    assert deadline.missed(2 * 10**12)


def test_a_deadline_of_zero_is_none() -> None:
    deadline = RpdoDeadline(0)
    deadline.received(0)
    assert not deadline.missed(10**12)


def test_in_simulated_time_the_syncs_count_and_not_the_clock() -> None:
    """Ten SYNCs of 10 ms without a command are within 100 ms, however long they take; the eleventh is not."""
    with driven() as rig:
        torques = []
        for _ in range(12):
            rig.cycle()
            torques.append(rig.rig.torque_nm[0])
        assert torques == pytest.approx([120.0] * 10 + [0.0] * 2)
        assert rig.cycle().state is PowerState.SWITCH_ON_DISABLED
        with pytest.raises(DeviceFault, match="EMCY 0x8250 RPDO timeout: the host's command did not come in time"):
            rig.m1.raise_if_faulted()


def test_between_two_syncs_no_simulated_time_passes() -> None:
    """Its own heartbeat, by which it looks for its host too, goes by the wall clock: every 10 ms."""
    with driven() as rig:
        for _ in range(10):
            rig.cycle()
        time.sleep(0.1)
        assert rig.rig.torque_nm[0] == pytest.approx(120.0)


def test_a_command_that_comes_again_ends_the_emergency_and_gives_no_torque() -> None:
    with driven() as rig:
        for _ in range(15):
            rig.cycle()
        feedback = rig.cycle(guarded(120.0))
        assert feedback.state is PowerState.SWITCH_ON_DISABLED
        assert rig.rig.torque_nm[0] == 0.0
        rig.m1.raise_if_faulted()


def until_without_torque(rig: Bench) -> None:
    """Wait for the drive alone; the timeout of the test ends it otherwise."""
    while rig.rig.torque_nm[0] != 0.0:
        time.sleep(0.005)


def test_in_real_time_a_host_that_sends_no_more_commands_is_missed_without_any_sync() -> None:
    """Its heart beats on: a program whose cycle hangs."""
    with driven(real_time=True) as rig:
        until_without_torque(rig)
        with pytest.raises(DeviceFault, match="EMCY 0x8250"):
            rig.m1.raise_if_faulted()


def test_a_host_whose_heart_stops_is_missed_without_any_frame() -> None:
    with driven() as rig:
        rig.link.stop_heartbeat()
        until_without_torque(rig)
        with pytest.raises(DeviceFault, match="EMCY 0x8130 life guard or heartbeat error"):
            rig.m1.raise_if_faulted()


def test_a_new_host_is_not_blamed_for_the_death_of_the_one_before() -> None:
    with driven() as rig:
        rig.link.stop_heartbeat()
        until_without_torque(rig)
        for inverter in (rig.m1, rig.m2):
            inverter.configure()
        rig.m1.arm()
        rig.cycle(guarded(60.0))
        rig.m1.raise_if_faulted()
        assert rig.rig.torque_nm[0] == pytest.approx(60.0)


def test_a_drive_that_is_reset_watches_nobody_until_it_is_configured() -> None:
    with driven() as rig:
        node = rig.rig._nodes[0]
        node._restart()
        node.look_for_host(time.monotonic_ns() + 3600 * 10**9)
        assert node._device.read(0x1001) == 0
