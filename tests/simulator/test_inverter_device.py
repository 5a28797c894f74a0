"""The simulated inverter as a model, stepped by hand."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from drivers.inverter.cia402 import STATUSWORD_STATE_BITS, Command, PowerState, next_state, state_of
from drivers.scaling import VelocityScale
from hil.simulator.drive_physics import SimulatedInverter
from hil.simulator.faults import AtStep, InverterFaults
from hil.simulator.inverter_device import InverterDevice, ObjectRefused

DEFAULTS = {0x6007: 2, 0x605A: 6, 0x605B: 0, 0x605C: 0, 0x605D: 1, 0x605E: 0}
QUIET = SimulatedInverter(5, torque_noise_counts=0.0, speed_noise_rad_s=0.0)
PERIOD_S = 0.01


def device(settings: SimulatedInverter = QUIET, seed: int = 1) -> InverterDevice:
    return InverterDevice(settings, DEFAULTS, VelocityScale.from_object(0xFDB44700, "the device"), seed)


def enabled(settings: SimulatedInverter = QUIET, mode: int = 10) -> InverterDevice:
    made = device(settings)
    made.write(0x6060, mode)
    for command in (Command.SHUTDOWN, Command.SWITCH_ON, Command.ENABLE_OPERATION):
        made.write(0x6040, command.value)
    return made


PATHS: dict[PowerState, tuple[Command, ...]] = {
    PowerState.SWITCH_ON_DISABLED: (),
    PowerState.READY_TO_SWITCH_ON: (Command.SHUTDOWN,),
    PowerState.SWITCHED_ON: (Command.SHUTDOWN, Command.SWITCH_ON),
    PowerState.OPERATION_ENABLED: (Command.SHUTDOWN, Command.SWITCH_ON, Command.ENABLE_OPERATION),
    PowerState.QUICK_STOP_ACTIVE: (Command.SHUTDOWN, Command.SWITCH_ON, Command.ENABLE_OPERATION, Command.QUICK_STOP),
}
"""How to get into each state that is reached by commands alone."""


@pytest.mark.parametrize(("state", "command"), [*itertools.product(PATHS, Command)])
def test_every_command_in_every_state_does_what_the_table_says(state: PowerState, command: Command) -> None:
    made = device()
    for step in PATHS[state]:
        made.write(0x6040, step.value)
    assert made.state is state
    made.write(0x6040, command.value)
    assert made.state is next_state(state, command)
    statusword = made.read(0x6041)
    assert statusword is not None
    assert state_of(statusword) is made.state


@pytest.mark.parametrize("command", Command)
def test_fault_is_left_by_fault_reset_alone(command: Command) -> None:
    made = device(replace(QUIET, faults=InverterFaults(fault=AtStep(0, 0x4310))))
    assert made.state is PowerState.FAULT
    made.write(0x6040, command.value)
    left = command is Command.FAULT_RESET
    assert made.state is (PowerState.SWITCH_ON_DISABLED if left else PowerState.FAULT)
    assert made.read(0x603F) == (0 if left else 0x4310)
    assert [emergency.code for emergency in made.take_emergencies()] == ([0x4310, 0] if left else [0x4310])
    assert made.take_emergencies() == []


@pytest.mark.parametrize("state", PATHS)
def test_torque_flows_in_operation_enabled_alone(state: PowerState) -> None:
    made = device()
    made.write(0x6060, 10)
    made.write(0x6071, 500)
    for step in PATHS[state]:
        made.write(0x6040, step.value)
    made.step(0.0, PERIOD_S)
    assert made.torque_nm == (300.0 if state is PowerState.OPERATION_ENABLED else 0.0)


@pytest.mark.parametrize("command", [Command.DISABLE_VOLTAGE, Command.SHUTDOWN, Command.SWITCH_ON])
def test_leaving_operation_enabled_takes_the_torque_away_at_once(command: Command) -> None:
    made = enabled()
    made.write(0x6071, 500)
    made.step(0.0, PERIOD_S)
    made.write(0x6040, command.value)
    assert made.torque_nm == 0.0


@pytest.mark.parametrize(("base", "prbs", "torque_nm", "limited"), [
    (1000, 0, 600.0, False),
    (990, 20, 600.0, True),
    (-1000, 0, -600.0, False),
    (-1000, -1, -600.0, True),
    (1000, 1000, 600.0, True),
    (990, -20, 582.0, False),
])  # fmt: skip
def test_torque_is_limited_to_max_torque_and_says_so(base: int, prbs: int, torque_nm: float, limited: bool) -> None:
    made = enabled()
    made.write(0x6071, base)
    made.write(0x60B2, prbs)
    made.step(0.0, PERIOD_S)
    assert made.torque_nm == pytest.approx(torque_nm)
    assert made.read(0x6077) == round(torque_nm / 0.6)
    assert bool((made.read(0x6041) or 0) & 1 << 11) is limited


@pytest.mark.parametrize("index", [0x6071, 0x60B2])
@pytest.mark.parametrize(("value", "abort_code"), [(1001, 0x06090031), (32767, 0x06090031), (-1001, 0x06090032)])
def test_a_torque_beyond_max_torque_is_refused_and_the_one_before_holds(
    index: int, value: int, abort_code: int
) -> None:
    made = enabled()
    made.write(index, 100)
    with pytest.raises(ObjectRefused) as refusal:
        made.write(index, value)
    assert refusal.value.abort_code == abort_code
    made.step(0.0, PERIOD_S)
    assert made.torque_nm == pytest.approx(60.0)
    assert (made.read(0x6041) or 0) & 1 << 11
    made.write(index, 50)
    made.step(0.0, PERIOD_S)
    assert made.torque_nm == pytest.approx(30.0)
    assert not (made.read(0x6041) or 0) & 1 << 11


def test_noise_has_the_size_it_is_given() -> None:
    """4000 draws: their standard deviation is within 5 % of the true one, by 4.5 of its own."""
    made = enabled(SimulatedInverter(5, torque_noise_counts=1.0, speed_noise_rad_s=0.05))
    made.write(0x6071, 100)
    torque, speed = [], []
    for _ in range(4000):
        made.step(100.0, PERIOD_S)
        torque.append(made.read(0x6077))
        speed.append(made.read(0x606C))
    rad_s = np.array(speed) * 2 * np.pi / 60_000
    assert np.std(rad_s) == pytest.approx(0.05, rel=0.05)
    assert np.mean(rad_s) == pytest.approx(100.0, abs=0.005)
    assert np.std(torque) == pytest.approx(np.sqrt(1.0 + 1 / 12), rel=0.05)  # rounding adds 1/12 of a count squared
    assert np.mean(torque) == pytest.approx(100.0, abs=0.1)


def test_reset_goes_back_to_power_on() -> None:
    made = enabled()
    made.write(0x6071, 100)
    made.reset()
    assert (made.state, made.read(0x6071), made.read(0x6061)) == (PowerState.SWITCH_ON_DISABLED, 0, 0)
    assert (made.read(0x6041) or 0) & 0x6F == STATUSWORD_STATE_BITS[PowerState.SWITCH_ON_DISABLED]
