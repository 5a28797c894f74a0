"""Inside a simulated drive: limits and heat, its own clock, its list of errors."""

import itertools
import math
from dataclasses import replace

import pytest

from drivers.inverter.cia402 import Command, StatusBit
from hil.simulator.drive_physics import ErrorList, Heat, SampleClock
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


@pytest.mark.parametrize("drift", [0.125, -0.125])
def test_the_age_grows_by_the_drift_and_wraps_after_a_period(drift: float) -> None:
    """Of a speed that grows by 1 per SYNC, what is read is behind by its age."""
    clock = SampleClock(drift * 1e6)
    ages = [k - clock.sample(float(k), 0.0)[0] for k in range(17)]
    assert ages == pytest.approx([0.0] + [(k * drift) % 1.0 for k in range(1, 17)])


@pytest.mark.parametrize(
    ("code", "register"),
    [(0x2310, 0x03), (0x3220, 0x05), (0x4310, 0x09), (0x8130, 0x11), (0x8250, 0x11), (0x7303, 0x01), (0x5441, 0x21)],
)
def test_the_register_tells_the_class(code: int, register: int) -> None:
    errors = ErrorList()
    errors.set(code)
    assert errors.register == register
    [emergency] = errors.take_due()
    assert (emergency.code, emergency.register) == (code, register)


def test_an_error_is_reported_once_and_its_end_when_all_are_gone() -> None:
    errors = ErrorList()
    for code in (0x8130, 0x8130, 0x4310):
        errors.set(code)
    errors.clear(0x8130)
    assert [each.code for each in errors.take_due()] == [0x8130, 0x4310]
    errors.clear()
    errors.clear()
    assert [(each.code, each.register) for each in errors.take_due()] == [(0, 0)]
    assert errors.take_due() == []


def test_the_history_has_the_newest_first_and_outlives_the_errors() -> None:
    errors = ErrorList()
    for code in (0x1000, 0x2310, 0x3220, 0x4310, 0x8130):
        errors.set(code)
    errors.clear()
    assert [errors.history(n) for n in range(6)] == [4, 0x8130, 0x4310, 0x3220, 0x2310, 0]
    errors.forget_history()
    assert [errors.history(n) for n in range(2)] == [0, 0]
