"""How a simulated drive stops: option codes, the loss of its host by heartbeat or RPDO."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import pytest

from drivers.canopen.can_link import CanLink
from drivers.errors import DeviceFault
from drivers.inverter.cia402 import Command, PowerState, TorqueMode
from drivers.inverter.inverter import Inverter
from hil.simulator.inverter_device import InverterDevice, ObjectRefused
from hil.simulator.simulated_rig import SimulatedRig
from hil.simulator.stopping import GRACE_NS, NS_PER_MS
from tests.drivers.can_bench import M1, M2, SIMULATED_M1, SIMULATED_M2, Bench, bench, guarded, new_channel, virtual_bus
from tests.simulator.rigid_plant import RigidPlant
from tests.simulator.test_inverter_device import PERIOD_S, QUIET, device

SLOPE_STEP, QUICK_STEP = 50, 100
"""Counts per period of the slopes below: 5000 per mille per second, and the drive's own 10 000."""

_S = PowerState


def running(torque: int = 250, **codes: int) -> InverterDevice:
    """A drive in operation at a torque, with option codes by object, such as ``x605A=1``."""
    made = device(QUIET)
    made.write(0x6060, TorqueMode.CYCLIC_SYNCHRONOUS_TORQUE)
    made.write(0x6087, 5000)
    for name, code in codes.items():
        made.write(int(name[1:], 16), code)
    for command in (Command.SHUTDOWN, Command.SWITCH_ON, Command.ENABLE_OPERATION):
        made.write(0x6040, command.value)
    made.write(0x6071, torque)
    made.step(0.0, PERIOD_S)
    return made


def course(made: InverterDevice, steps: int = 6) -> list[tuple[int, PowerState]]:
    """Torque [per mille] and state after each SYNC, from now on."""
    seen = []
    for _ in range(steps):
        made.step(0.0, PERIOD_S)
        seen.append((round(made.torque_nm / 0.6), made.state))
    return seen


def ramp(step: int, passing: PowerState, final: PowerState) -> list[tuple[int, PowerState]]:
    """From 250 to zero; the state is left with the last of the torque."""
    values = [max(250 - step * (k + 1), 0) for k in range(6)]
    return [(value, passing if value else final) for value in values]


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        (0, [(0, _S.SWITCH_ON_DISABLED)] * 6),
        (1, ramp(SLOPE_STEP, _S.QUICK_STOP_ACTIVE, _S.SWITCH_ON_DISABLED)),
        (2, ramp(QUICK_STEP, _S.QUICK_STOP_ACTIVE, _S.SWITCH_ON_DISABLED)),
        (3, [(0, _S.SWITCH_ON_DISABLED)] * 6),
        (5, ramp(SLOPE_STEP, _S.QUICK_STOP_ACTIVE, _S.QUICK_STOP_ACTIVE)),
        (6, ramp(QUICK_STEP, _S.QUICK_STOP_ACTIVE, _S.QUICK_STOP_ACTIVE)),
        (7, [(0, _S.QUICK_STOP_ACTIVE)] * 6),
    ],
)
def test_quick_stop(code: int, expected: list[tuple[int, PowerState]]) -> None:
    made = running(x605A=code)
    made.write(0x6040, Command.QUICK_STOP.value)
    assert course(made) == expected


@pytest.mark.parametrize(
    ("command", "index", "final"),
    [(Command.SHUTDOWN, "x605B", _S.READY_TO_SWITCH_ON), (Command.SWITCH_ON, "x605C", _S.SWITCHED_ON)],
)
def test_shutdown_and_disable_operation_stay_in_operation_until_the_ramp_is_over(
    command: Command, index: str, final: PowerState
) -> None:
    at_once = running(**{index: 0})
    at_once.write(0x6040, command.value)
    assert (at_once.torque_nm, at_once.state) == (0.0, final)
    slowly = running(**{index: 1})
    slowly.write(0x6040, command.value)
    assert course(slowly) == ramp(SLOPE_STEP, _S.OPERATION_ENABLED, final)


def test_disable_voltage_ends_every_ramp_at_once() -> None:
    made = running(x605A=1)
    made.write(0x6040, Command.QUICK_STOP.value)
    course(made, 1)
    made.write(0x6040, Command.DISABLE_VOLTAGE.value)
    assert (made.torque_nm, made.state) == (0.0, _S.SWITCH_ON_DISABLED)


@pytest.mark.parametrize(("code", "step"), [(1, SLOPE_STEP), (2, QUICK_STEP), (3, 250)])
def test_halt_takes_the_torque_away_and_gives_it_back(code: int, step: int) -> None:
    made = running(x605D=code)
    halted = Command.ENABLE_OPERATION.value | 1 << 8
    made.write(0x6040, halted)
    assert course(made) == ramp(step, _S.OPERATION_ENABLED, _S.OPERATION_ENABLED)
    made.write(0x6040, Command.ENABLE_OPERATION.value)
    assert course(made, 1) == [(250, _S.OPERATION_ENABLED)]


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        (0, [(0, _S.FAULT)] * 6),
        (1, ramp(SLOPE_STEP, _S.FAULT_REACTION_ACTIVE, _S.FAULT)),
        (2, ramp(QUICK_STEP, _S.FAULT_REACTION_ACTIVE, _S.FAULT)),
    ],
)
def test_fault_reaction(code: int, expected: list[tuple[int, PowerState]]) -> None:
    made = running(x605E=code)
    made.fail(0x7303)
    assert course(made) == expected
    assert [emergency.code for emergency in made.take_emergencies()] == [0x7303]


@pytest.mark.parametrize(
    ("code", "first", "last"),
    [
        (0, (250, _S.OPERATION_ENABLED), (250, _S.OPERATION_ENABLED)),
        (1, (200, _S.FAULT_REACTION_ACTIVE), (0, _S.FAULT)),
        (2, (0, _S.SWITCH_ON_DISABLED), (0, _S.SWITCH_ON_DISABLED)),
        (3, (200, _S.QUICK_STOP_ACTIVE), (0, _S.SWITCH_ON_DISABLED)),
    ],
)
def test_abort_connection(code: int, first: tuple[int, PowerState], last: tuple[int, PowerState]) -> None:
    made = running(x6007=code, x605A=1, x605E=1)
    made.lose_connection(0x8130)
    seen = course(made)
    assert (seen[0], seen[-1]) == (first, last)


@pytest.mark.parametrize(
    ("index", "code"), [(0x6007, 4), (0x605A, 9), (0x605A, -1), (0x605B, 2), (0x605C, 2), (0x605D, 0), (0x605E, -1)]
)
def test_a_code_it_does_not_know_is_refused(index: int, code: int) -> None:
    made = device(QUIET)
    before = made.read(index)
    with pytest.raises(ObjectRefused, match="0x06090030"):
        made.write(index, code)
    assert made.read(index) == before


LONG_NS = 3600 * 1_000_000_000


LOOKS = range(0, GRACE_NS + 1, 10 * NS_PER_MS)
"""A drive looks every 10 ms, for as long as one that was held up itself needs to hear its host again."""


def test_a_drive_without_its_host_gives_no_torque_and_leaves_operation() -> None:
    with bench() as rig:
        for inverter in (rig.m1, rig.m2):
            inverter.configure()
        rig.m1.arm()
        rig.cycle(guarded(120.0))
        assert rig.rig.torque_nm[0] == pytest.approx(120.0)
        rig.link.stop_heartbeat()
        for node in rig.rig._nodes:
            now_ns = time.monotonic_ns() + LONG_NS
            for later_ns in LOOKS:
                node.look_for_host(now_ns + later_ns)
        assert rig.rig.torque_nm == (0.0, 0.0)
        assert rig.rig._nodes[0]._device.state is PowerState.SWITCH_ON_DISABLED
        with pytest.raises(DeviceFault, match="EMCY 0x8130 life guard or heartbeat error"):
            rig.until_raised()


def test_a_drive_watches_its_host_as_soon_as_it_is_configured() -> None:
    """The next heartbeat of the period may be long in coming: a host that dies before it is missed all the same."""
    with bench(settings=replace(M1, host_timeout_ms=60_000)) as rig:
        rig.m1.configure()
        rig.m1.arm()
        rig.m1.command(guarded(120.0))
        assert rig.m1.await_feedback(rig.link.sync(), 5.0) is not None
        assert rig.rig.torque_nm[0] == pytest.approx(120.0)
        rig.link.stop_heartbeat()
        now_ns = time.monotonic_ns() + LONG_NS
        for later_ns in LOOKS:
            rig.rig._nodes[0].look_for_host(now_ns + later_ns)
        assert rig.rig.torque_nm[0] == 0.0


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


def test_a_drive_that_is_reset_watches_nobody_until_it_is_configured() -> None:
    with driven() as rig:
        node = rig.rig._nodes[0]
        node._restart()
        node.look_for_host(time.monotonic_ns() + 3600 * 10**9)
        assert node._device.read(0x1001) == 0
