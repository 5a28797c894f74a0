"""The host's inverter against the simulated one: the whole way from check to disarm."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.canopen.can_link import CanLink
from drivers.errors import CommandRefused, DeviceTimeout, ForeignController, ProtocolViolation
from drivers.inverter.cia402 import PowerState
from drivers.inverter.inverter import Inverter
from drivers.resources import data_file
from tests.drivers.can_bench import HASTY_M1, M1, Bench, bench, frame, guarded, new_channel, repeat
from tests.simulator.rigid_plant import RigidPlant


@pytest.fixture
def healthy() -> Iterator[Bench]:
    with bench(plant=RigidPlant(100.0, 0.5, speed_rad_s=150.0)) as rig:
        yield rig


@pytest.fixture
def armed(healthy: Bench) -> Bench:
    for inverter in (healthy.m1, healthy.m2):
        inverter.configure()
        inverter.arm()
    return healthy


def test_armed_drive_gives_no_torque_until_commanded(armed: Bench) -> None:
    feedback = armed.cycle()
    assert feedback.state is PowerState.OPERATION_ENABLED
    assert armed.rig.torque_nm == (0.0, 0.0)


def test_torque_commanded_takes_effect_at_the_next_sync_and_not_before(armed: Bench) -> None:
    armed.cycle(guarded(120.0, 12.0), guarded(-60.0, -6.0))
    assert armed.rig.torque_nm == pytest.approx((132.0, -66.0))
    armed.m1.command(guarded(30.0))
    armed.m1.check()  # an SDO answer comes after the RPDO before it: the drive has it, and waits for SYNC
    assert armed.rig.torque_nm == pytest.approx((132.0, -66.0))
    armed.cycle()
    assert armed.rig.torque_nm == pytest.approx((30.0, -66.0))


def test_feedback_is_in_si_with_its_counts(armed: Bench) -> None:
    first = armed.cycle(guarded(240.0))
    second = armed.cycle(guarded(240.0))
    assert second.torque_nm == pytest.approx(240.0, abs=5 * 0.6)  # noise of one count, 0.6 Nm
    assert second.torque_nm == pytest.approx(second.torque_raw * 0.6)
    assert second.speed_rad_s == pytest.approx(150.0, abs=5 * 0.05)
    assert second.speed_rad_s == pytest.approx(second.speed_raw * 1e-3 * 2 * 3.14159265 / 60)
    assert second.t_ns > first.t_ns
    assert armed.m1.latest == second


def test_feedback_of_an_older_sync_does_not_count(armed: Bench) -> None:
    feedback = armed.cycle()
    assert armed.m1.await_feedback(feedback.t_ns, timeout_s=0.0) is None


def test_torque_that_does_not_fit_its_object_is_refused(armed: Bench) -> None:
    armed.cycle(guarded(60.0))
    with pytest.raises(CommandRefused, match=r"inverter m1 \(node 5\): torque 20000\.0 Nm is 33333 per mille"):
        armed.m1.command(guarded(20_000.0))
    armed.cycle()
    assert armed.rig.torque_nm[0] == pytest.approx(60.0)


def test_disarmed_drive_takes_no_torque(armed: Bench) -> None:
    armed.cycle(guarded(120.0))
    armed.m1.disarm()
    assert armed.rig.torque_nm[0] == 0.0
    with pytest.raises(CommandRefused, match=r"120\.0 Nm commanded while disarmed"):
        armed.m1.command(guarded(120.0))
    assert armed.cycle().state is PowerState.SWITCH_ON_DISABLED


def test_command_still_waiting_for_sync_does_not_survive_disarming(armed: Bench) -> None:
    armed.cycle(guarded(120.0))
    armed.m1.command(guarded(180.0))
    armed.m1.disarm()
    armed.cycle()
    assert armed.rig.torque_nm[0] == 0.0
    assert armed.cycle().state is PowerState.SWITCH_ON_DISABLED


def test_a_drive_that_another_host_has_enabled_gets_no_nmt_command(armed: Bench) -> None:
    armed.cycle(guarded(120.0))
    with CanLink.open(f"virtual:{armed.channel}") as link:
        with pytest.raises(ForeignController, match=r"m1 \(node 5\): power state is operation enabled"):
            Inverter(link, M1).configure()
        assert armed.rig.torque_nm[0] == pytest.approx(120.0)


def test_changed_mapping_in_the_eds_is_configured_and_used(tmp_path: Path) -> None:
    """Same objects in another order: the device gets the EDS's mapping, both ends then speak it."""
    eds = tmp_path / "other.eds"
    text = data_file("inverter.eds").read_text()
    eds.write_text(text.replace("60770010", "SWAP").replace("606C0020", "60770010").replace("SWAP", "606C0020"))
    with bench(settings=replace(M1, eds_path=eds)) as rig:
        assert rig.m1.check() == ()
        [remark] = rig.m1.remarks()
        assert remark.startswith("PDO 0x1800/0x1A00 has [")
        rig.m1.configure()
        rig.m1.arm()
        assert rig.cycle(guarded(240.0)).torque_nm == pytest.approx(240.0, abs=3.0)
        assert rig.m1.check() == ()


def test_tpdo_of_another_length_is_a_violation(armed: Bench) -> None:
    with armed.intruder() as bus:
        bus.send(frame(0x185, bytes(5)))
        with pytest.raises(ProtocolViolation, match=r"frame of 5 bytes, expected 8.*configure it again"):
            repeat(armed.m1.raise_if_faulted)


def test_absent_node_is_a_timeout_everywhere() -> None:
    with CanLink.open(f"virtual:{new_channel()}") as link:
        inverter = Inverter(link, HASTY_M1)
        for step in (inverter.check, inverter.configure, inverter.arm, inverter.disarm, inverter.reset_fault):
            with pytest.raises(DeviceTimeout, match=r"inverter m1 \(node 5\): no SDO answer"):
                step()
        assert inverter.await_feedback(link.sync(), timeout_s=0.02) is None
        with pytest.raises(DeviceTimeout, match="last heartbeat never"):
            repeat(inverter.raise_if_faulted)
