"""The simulated PLC's program, in simulated time and with nothing connected."""

import pytest

from drivers.plc.register import Value
from drivers.plc.types import ClutchState, DriveMode
from estimator.signals.prbs import Prbs
from hil.simulator.faults import PlcAnswers, PlcFaults
from hil.simulator.plc_device import PlcDevice, PlcSetup

RUNNING: dict[str, Value] = {
    "prbs_amplitude": 60.0,
    "prbs_divider": 1,
    "prbs_seed": 5,
    "prbs_source": "plc",
    "prbs_enable": True,
}


@pytest.mark.parametrize("dt_s", [0.001, 0.01, 0.0025, 0.1])
def test_the_watchdog_counts_cycles_whatever_the_step(dt_s: float) -> None:
    device = PlcDevice()
    for _ in range(round(2.0 / dt_s)):
        device.step(dt_s)
    assert device.values()["plc_count"] == 200


@pytest.mark.parametrize(
    ("mode", "clutch"),
    [
        (DriveMode.SERIES, ClutchState.OPEN),
        (DriveMode.PARALLEL, ClutchState.CLOSED),
        (DriveMode.ELECTRIC, ClutchState.OPEN),
    ],
)
def test_the_drive_mode_moves_the_clutch(mode: DriveMode, clutch: ClutchState) -> None:
    device = PlcDevice()
    device.write({"drive_mode_request": mode.value})
    assert device.values()["drive_mode"] == mode.value
    assert device.clutch is clutch
    assert PlcDevice(PlcSetup(drive_mode=mode)).clutch is clutch


def test_the_clutch_closes_when_ordered_and_stays() -> None:
    device = PlcDevice(faults=PlcFaults(clutch_closes_at_s=1.0))
    device.step(0.99)
    assert device.clutch is ClutchState.OPEN
    device.step(0.01)
    assert device.clutch is ClutchState.CLOSED
    device.write({"drive_mode_request": "series"})
    device.step(0.01)
    assert device.clutch is ClutchState.CLOSED


def test_the_permissive_goes_when_ordered_and_stays_away() -> None:
    device = PlcDevice(faults=PlcFaults(permissive_withdrawn_at_s=0.5))
    device.step(0.49)
    assert device.values()["permissive"] is True
    device.step(0.02)
    assert device.values()["permissive"] is False


class TestHostWatchdog:
    def test_a_host_that_stops_beating_loses_the_permissive(self) -> None:
        device = PlcDevice(PlcSetup(host_timeout_s=0.5))
        device.write({"host_count": 1})
        device.step(0.5)
        assert device.values()["permissive"] is True
        device.step(0.01)
        assert device.values()["permissive"] is False

    def test_a_host_that_beats_keeps_it(self) -> None:
        device = PlcDevice(PlcSetup(host_timeout_s=0.5))
        for count in range(10):
            device.write({"host_count": count})
            device.step(0.4)
        assert device.values()["permissive"] is True

    def test_the_permissive_comes_back_with_the_beats(self) -> None:
        device = PlcDevice(PlcSetup(host_timeout_s=0.5))
        device.write({"host_count": 1})
        device.step(0.6)
        assert device.values()["permissive"] is False
        device.write({"host_count": 2})
        assert device.values()["permissive"] is True

    def test_a_permissive_withdrawn_by_the_vehicle_does_not(self) -> None:
        device = PlcDevice(PlcSetup(host_timeout_s=0.5))
        device.write({"host_count": 1})
        device._permissive = False
        device.write({"host_count": 2})
        assert device.values()["permissive"] is False


class TestPrbs:
    def levels(self, device: PlcDevice, cycles: int) -> list[float]:
        course = []
        for _ in range(cycles):
            course.append(device.prbs_torque_nm)
            device.step(0.01)
        return course

    def test_one_period_is_of_maximum_length(self) -> None:
        device = PlcDevice()
        device.write(RUNNING)
        course = self.levels(device, 2 * 1023)
        assert course[:1023] == course[1023:]
        assert course[:1023].count(60.0) == 512
        assert course[:1023].count(-60.0) == 511

    @pytest.mark.parametrize("divider", [1, 3])
    def test_it_agrees_with_the_host_s_generator(self, divider: int) -> None:
        device = PlcDevice()
        device.write({**RUNNING, "prbs_divider": divider})
        host = Prbs(60.0, cells=10, clock_divider=divider, seed=5)
        assert self.levels(device, 500) == [host.next() for _ in range(500)]

    def test_it_is_silent_while_torque_is_not_permitted(self) -> None:
        device = PlcDevice(PlcSetup(host_timeout_s=0.5))
        device.write({**RUNNING, "host_count": 1})
        assert 0.0 not in self.levels(device, 50)
        device.step(0.01)
        assert device.prbs_torque_nm == 0.0
        device.write({"host_count": 2})
        assert device.prbs_torque_nm != 0.0
        device._permissive = False
        assert device.prbs_torque_nm == 0.0

    @pytest.mark.parametrize("change", [{"prbs_enable": False}, {"prbs_source": "host"}])
    def test_it_is_silent_unless_enabled_and_the_source(self, change: dict[str, Value]) -> None:
        device = PlcDevice()
        device.write(RUNNING)
        device.write(change)
        assert set(self.levels(device, 20)) == {0.0}
        assert device.values()["prbs_torque"] == 0.0


@pytest.mark.parametrize(
    "faults",
    [
        {(0.5, PlcAnswers.NOT)},
        {(0.2, PlcAnswers.WELL), (0.5, PlcAnswers.NOT)},
        {(0.5, PlcAnswers.NOT), (0.9, PlcAnswers.HALF)},
    ],
)
def test_it_answers_well_until_a_fault_begins(faults: set[tuple[float, PlcAnswers]]) -> None:
    device = PlcDevice(faults=PlcFaults(answers_at_s=frozenset(faults)))
    device.step(0.49)
    assert device.answers is PlcAnswers.WELL
    device.step(0.01)
    assert device.answers is PlcAnswers.NOT
