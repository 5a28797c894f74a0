"""The host's inverter against simulated ones with something wrong: each fault named, never passed over."""

from dataclasses import replace
from pathlib import Path

import pytest

from drivers.errors import ConfigMismatch, DeviceFault, DeviceTimeout
from drivers.inverter.cia402 import PowerState, TorqueMode
from drivers.resources import data_file
from hil.simulator.faults import AtStep, InverterFaults
from tests.drivers.can_bench import M1, SIMULATED_M1, Bench, bench, guarded

OVER_CURRENT = 0x2310


def start(rig: Bench) -> None:
    rig.m1.configure()
    rig.m1.arm()


@pytest.mark.parametrize(
    ("settings", "faults", "what", "found", "expected"),
    [
        (M1, InverterFaults(identity=(0x9A, 0x402)), "vendor-ID 0x1018:01", "0x0000009A", "0x000003E7"),
        (replace(M1, vendor_id=1), InverterFaults(), "vendor-ID 0x1018:01", "0x000003E7", "0x00000001"),
    ],
)
def test_device_that_is_another_is_found_and_refused(
    settings: object, faults: InverterFaults, what: str, found: str, expected: str
) -> None:
    with bench(faults, settings=settings) as rig:
        [difference] = rig.m1.check()
        assert (difference.what, difference.found, difference.expected) == (what, found, expected)
        with pytest.raises(ConfigMismatch, match=f"{what} is {found}, expected {expected}.*Correct the rig file"):
            rig.m1.configure()


def test_mode_that_is_not_supported_is_found_by_check_and_refused() -> None:
    profile_only = replace(SIMULATED_M1, supported_modes=frozenset({TorqueMode.PROFILE_TORQUE}))
    with bench(simulated=profile_only) as rig:
        [difference] = rig.m1.check()
        assert difference.what == "supported drive modes 0x6502"
        assert difference.found == "0x00000008 with 4 (profile torque)"
        with pytest.raises(ConfigMismatch, match=r"expected mode 10 \(cyclic synchronous torque\) among them"):
            rig.m1.configure()
        with pytest.raises(ConfigMismatch, match=r"mode of operation 10 .* refused, it stays at 0\. .*0x06090030"):
            rig.m1.arm()


def test_state_machine_that_does_not_follow_is_refused_with_both_states() -> None:
    with bench(InverterFaults(ignored_writes=frozenset({0x6040}))) as rig:
        rig.m1.configure()
        with pytest.raises(
            DeviceTimeout, match=r"power state is switch on disabled after .* expected ready to switch on"
        ):
            rig.m1.arm()


@pytest.mark.parametrize("index", [0x1400, 0x1600, 0x1800, 0x1A00, 0x1016, 0x1017])
def test_configuration_that_does_not_hold_is_refused(index: int, tmp_path: Path) -> None:
    eds = tmp_path / "drive.eds"
    eds.write_text(data_file("inverter.eds").read_text().replace("\nDefaultValue=3", "\nDefaultValue=1"))
    faults, simulated = InverterFaults(ignored_writes=frozenset({index})), replace(SIMULATED_M1, eds_path=eds)
    with bench(faults, settings=replace(M1, eds_path=eds), simulated=simulated) as rig:
        with pytest.raises(ConfigMismatch, match=rf"object 0x{index:04X}:.. reads .* after writing"):
            rig.m1.configure()


def test_drive_whose_own_code_leaves_the_torque_is_refused_until_the_rig_file_has_another() -> None:
    with bench() as rig:
        rig.m1._sdo.download(0x6007, 0, 0)
        [difference] = rig.m1.check()
        assert difference.found == "0, no action: the torque would stay without the host"
        with pytest.raises(ConfigMismatch, match=r"0x6007:00 is 0, no action.*option_codes = \{ abort_connection = 2"):
            rig.m1.configure()
    with bench(settings=replace(M1, option_codes={0x6007: 2})) as rig:
        rig.m1._sdo.download(0x6007, 0, 0)
        rig.m1.configure()
        assert rig.m1._sdo.upload(0x6007) == 2


def test_fault_in_operation_is_raised_with_its_cause_and_takes_the_torque_away() -> None:
    with bench(InverterFaults(fault=AtStep(3, OVER_CURRENT))) as rig:
        start(rig)
        for _ in range(2):
            rig.cycle(guarded(120.0))
            rig.m1.raise_if_faulted()
        assert rig.cycle(guarded(120.0)).state is PowerState.FAULT
        assert rig.rig.torque_nm[0] == 0.0
        with pytest.raises(DeviceFault, match=r"EMCY 0x2310 continuous over-current, motor side \(error register 0x03"):
            rig.m1.raise_if_faulted()
        rig.m1.disarm()


def test_drive_in_fault_is_not_armed_until_it_is_reset() -> None:
    with bench(InverterFaults(fault=AtStep(0, OVER_CURRENT))) as rig:
        rig.m1.configure()
        with pytest.raises(DeviceFault, match="power state is fault, error code 0x603F is 0x2310"):
            rig.m1.arm()
        rig.m1.reset_fault()
        rig.m1.arm()
        assert rig.cycle(guarded(60.0)).state is PowerState.OPERATION_ENABLED
        rig.m1.raise_if_faulted()


def test_fault_that_can_not_be_reset_is_refused() -> None:
    faults = InverterFaults(fault=AtStep(0, OVER_CURRENT), ignored_writes=frozenset({0x6040}))
    with bench(faults) as rig:
        rig.m1.configure()
        with pytest.raises(DeviceTimeout, match=r"power state is fault after .* expected without fault"):
            rig.m1.reset_fault()


def test_drive_that_hangs_gives_no_feedback_then_loses_its_heartbeat() -> None:
    with bench(InverterFaults(hang_at_step=3)) as rig:
        start(rig)
        for _ in range(2):
            rig.cycle(guarded(120.0))
        rig.m1.command(guarded(120.0))
        assert rig.m1.await_feedback(rig.link.sync(), timeout_s=0.02) is None
        assert rig.rig.torque_nm[0] == 0.0
        with pytest.raises(DeviceTimeout, match=r"last heartbeat \d+ ms ago, in OPERATIONAL, expected one every 500"):
            rig.until_raised()


def test_drive_that_hangs_can_not_be_disarmed_and_every_step_is_reported() -> None:
    with bench(InverterFaults(hang_at_step=1)) as rig:
        start(rig)
        rig.m1.await_feedback(rig.link.sync(), timeout_s=0.02)
        rig.m1._sdo._client.RESPONSE_TIMEOUT = 0.02
        with pytest.raises(DeviceTimeout, match="no SDO answer for object 0x6071:00") as failed:
            rig.m1.disarm()
        [note] = failed.value.__notes__
        assert "0x6040:00" in note
