"""What keeps a simulated drive from its torque: closed forms, and what its objects tell of it."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import pytest

from drivers.inverter.cia402 import Command, StatusBit
from hil.simulator.drive_physics import Heat
from hil.simulator.faults import DriveLimits, InverterFaults
from hil.simulator.inverter_device import InverterDevice
from tests.simulator.test_inverter_device import PERIOD_S, QUIET, enabled


def limited(**limits: float) -> InverterDevice:
    made = enabled(replace(QUIET, faults=InverterFaults(limits=DriveLimits(**limits))))  # type: ignore[arg-type]
    made.write(0x6071, 1000)
    return made


@pytest.mark.parametrize(
    ("speed_rad_s", "torque_nm"), [(0.0, 600.0), (100.0, 600.0), (150.0, 400.0), (-300.0, 200.0), (600.0, 100.0)]
)
def test_power_is_constant_above_the_base_speed(speed_rad_s: float, torque_nm: float) -> None:
    made = limited(base_speed_rad_s=100.0)
    made.step(speed_rad_s, PERIOD_S)
    assert made.torque_nm == pytest.approx(torque_nm)
    assert bool((made.read(0x6041) or 0) & StatusBit.INTERNAL_LIMIT_ACTIVE) is (torque_nm < 600.0)


def test_a_weakened_field_takes_more_current_for_the_same_torque() -> None:
    made = limited(base_speed_rad_s=100.0)
    made.write(0x6071, 300)
    for speed_rad_s, current in ((50.0, 300), (200.0, 600)):
        made.step(speed_rad_s, PERIOD_S)
        assert (made.read(0x6077), made.read(0x6078)) == (300, current)


def test_heat_rises_as_its_closed_form() -> None:
    limits = DriveLimits(continuous_permille=500.0, thermal_time_constant_s=10.0)
    heat = Heat(limits)
    for _ in range(100):
        heat.pass_time(500.0, 0.1)
    x = 1.0 - math.exp(-1.0)  # after one time constant
    part = min((1.0 - x) / 0.1, 1.0)
    assert heat.limit_permille(1000.0) == pytest.approx(500.0 + part * 500.0)
    assert not heat.derating


def test_a_torque_above_the_continuous_one_derates_to_it_and_warns() -> None:
    made = limited(continuous_permille=500.0, thermal_time_constant_s=1.0)
    course = []
    for _ in range(1000):
        made.step(0.0, PERIOD_S)
        course.append(made.torque_nm)
    assert course[0] == 600.0
    assert all(later <= earlier + 1e-9 for earlier, later in itertools.pairwise(course))
    assert course[-1] == pytest.approx(300.0, rel=0.05)  # where the heat it makes is the heat it loses
    status = made.read(0x6041) or 0
    assert status & StatusBit.WARNING
    assert status & StatusBit.INTERNAL_LIMIT_ACTIVE


def test_without_limits_of_its_own_a_drive_gives_its_max_torque_for_ever() -> None:
    made = limited()
    for _ in range(1000):
        made.step(500.0, 1.0)
    assert made.torque_nm == 600.0


@pytest.mark.parametrize(("target", "reading"), [(7, 0), (13, 20), (987, 980), (-13, -20)])
def test_readings_come_in_the_steps_the_drive_tells_them_in(target: int, reading: int) -> None:
    made = limited(torque_step_permille=20)
    made.write(0x6071, target)
    made.step(0.0, PERIOD_S)
    assert (made.read(0x6077), made.read(0x6078)) == (reading, reading)
    assert made.torque_nm == pytest.approx(0.6 * target)


def test_a_brown_out_is_a_fault_that_stays_until_the_supply_is_back() -> None:
    made = enabled(replace(QUIET, faults=InverterFaults(brown_out_at_step=2)))
    made.write(0x6071, 100)
    made.step(0.0, PERIOD_S)
    assert (made.read(0x6079), made.torque_nm) == (650_000, 60.0)
    for _ in range(3):
        made.step(0.0, PERIOD_S)
    assert (made.read(0x6079) or 0) < 455_000
    assert (made.read(0x603F), made.torque_nm) == (0x3220, 0.0)
    assert not (made.read(0x6041) or 0) & StatusBit.VOLTAGE_ENABLED
    made.write(0x6040, Command.FAULT_RESET.value)
    assert made.read(0x603F) == 0x3220
    made._dc_link.supplied = True
    made.step(0.0, PERIOD_S)
    made.write(0x6040, 0)
    made.write(0x6040, Command.FAULT_RESET.value)
    assert made.read(0x603F) == 0
