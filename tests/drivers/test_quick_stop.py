"""Quick stop as a command: over when the drive says so, by state and by torque."""

from dataclasses import replace

import pytest

from drivers.errors import CommandRefused, DeviceTimeout
from drivers.inverter.cia402 import PowerState
from hil.simulator.faults import InverterFaults
from tests.drivers.can_bench import M1, Bench, bench, guarded


def running(rig: Bench) -> None:
    rig.m1.configure()
    rig.m1.arm()
    rig.cycle(guarded(300.0))
    assert rig.rig.torque_nm[0] == pytest.approx(300.0)


@pytest.mark.parametrize(
    ("code", "state"),
    [
        (0, PowerState.SWITCH_ON_DISABLED),
        (2, PowerState.SWITCH_ON_DISABLED),
        (6, PowerState.QUICK_STOP_ACTIVE),
        (7, PowerState.QUICK_STOP_ACTIVE),
    ],
)
def test_quick_stop_ends_as_its_option_code_has_it(code: int, state: PowerState) -> None:
    with bench(settings=replace(M1, option_codes={0x605A: code})) as rig:
        running(rig)
        rig.m1.quick_stop()
        assert rig.m1._power.state() is state
        assert rig.rig.torque_nm[0] == 0.0
        with pytest.raises(CommandRefused, match="while disarmed"):
            rig.m1.command(guarded(60.0))
        rig.m1.disarm()


def test_drive_that_does_not_leave_operation_is_reported() -> None:
    with bench() as rig:
        running(rig)
        rig.rig._m1._server.ignored_writes = frozenset({0x6040})
        with pytest.raises(DeviceTimeout, match=r"power state is operation enabled after .* expected out of operation"):
            rig.m1.quick_stop()


def test_ramp_that_does_not_end_in_time_is_reported_with_the_torque_that_is_left() -> None:
    settings = replace(M1, option_codes={0x605A: 1}, torque_slope_nm_per_s=0.6, state_timeout_s=0.05)
    with bench(InverterFaults(), settings=settings) as rig:
        running(rig)
        with pytest.raises(
            DeviceTimeout, match=r"torque actual value 0x6077 is [45]\d\.?\d* % .*in quick stop active.*0x605A"
        ):
            rig.m1.quick_stop()
        rig.m1.disarm()
        assert rig.rig.torque_nm[0] == 0.0
