"""Option codes of the simulated drive: each does what its number says, reported by torque and state, SYNC by SYNC."""

from __future__ import annotations

import pytest

from drivers.inverter.cia402 import Command, PowerState, TorqueMode
from hil.simulator.inverter_device import InverterDevice, ObjectRefused
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


def test_a_command_that_is_repeated_does_not_begin_the_ramp_anew() -> None:
    made = running(x605B=1)
    seen = []
    for _ in range(6):
        made.write(0x6040, Command.SHUTDOWN.value)
        seen += course(made, 1)
    assert seen == ramp(SLOPE_STEP, _S.OPERATION_ENABLED, _S.READY_TO_SWITCH_ON)


def test_operation_that_is_enabled_again_ends_the_ramp() -> None:
    made = running(x605B=1)
    made.write(0x6040, Command.SHUTDOWN.value)
    course(made, 2)
    made.write(0x6040, Command.ENABLE_OPERATION.value)
    assert course(made, 1) == [(250, _S.OPERATION_ENABLED)]


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


def test_a_lost_connection_is_no_fault_of_a_drive_without_torque() -> None:
    made = device(QUIET)
    made.write(0x6007, 1)
    made.lose_connection(0x8130)
    assert made.state is _S.SWITCH_ON_DISABLED


@pytest.mark.parametrize(
    ("index", "code"), [(0x6007, 4), (0x605A, 9), (0x605A, -1), (0x605B, 2), (0x605C, 2), (0x605D, 0), (0x605E, -1)]
)
def test_a_code_it_does_not_know_is_refused(index: int, code: int) -> None:
    made = device(QUIET)
    before = made.read(index)
    with pytest.raises(ObjectRefused, match="0x06090030"):
        made.write(index, code)
    assert made.read(index) == before
