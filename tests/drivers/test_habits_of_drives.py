"""The host's inverter against drives with the habits of real ones, each one as makers and users have reported it."""

from dataclasses import replace
from pathlib import Path

import can
import pytest

from drivers.canopen.can_link import CanLink
from drivers.canopen.heartbeat import NmtState
from drivers.errors import DeviceFault, DeviceTimeout
from drivers.inverter.cia402 import PowerState, StatusBit
from drivers.inverter.inverter import Inverter
from drivers.resources import data_file
from tests.drivers.can_bench import M1, bench, guarded
from tests.drivers.fake_drive import DEVICE_STATE, VALUE_RANGE, FakeDrive, on_bus

NO_RTR, INVALID = 1 << 30, 1 << 31


def is_cob_id(index: int, subindex: int) -> bool:
    return subindex == 1 and (0x1400 <= index < 0x1600 or 0x1800 <= index < 0x1A00)


class NoRemoteFrames(FakeDrive):
    """A stack that knows no RTR: its TPDOs have bit 30, and one without it is refused (embedded-office)."""

    def __init__(self, *args: object) -> None:
        super().__init__(*args)  # type: ignore[arg-type]
        self.objects[0x1800, 1] |= NO_RTR

    def refusal(self, index: int, subindex: int, value: int) -> int | None:
        return VALUE_RANGE if index == 0x1800 and subindex == 1 and not value & NO_RTR else None


class SetsBit30(FakeDrive):
    """Sets bit 30 by itself, whatever is written."""

    def written(self, index: int, subindex: int, value: int) -> int:
        return value | NO_RTR if is_cob_id(index, subindex) else value


class ClearsBit30(NoRemoteFrames):
    """Clears bit 30, whatever is written."""

    def refusal(self, index: int, subindex: int, value: int) -> int | None:
        return None

    def written(self, index: int, subindex: int, value: int) -> int:
        return value & ~NO_RTR if is_cob_id(index, subindex) else value


class Strict(FakeDrive):
    """Takes CiA 301, 7.5.2.35 by its word: no bit but 31 changes while a PDO is on, and none is mapped then."""

    def refusal(self, index: int, subindex: int, value: int) -> int | None:
        if is_cob_id(index, subindex):
            present = self.objects[index, 1]
            return VALUE_RANGE if not present & INVALID and (present ^ value) & ~INVALID else None
        if 0x1600 <= index < 0x1800 or 0x1A00 <= index < 0x1C00:
            on = not self.objects[index - 0x200, 1] & INVALID
            return DEVICE_STATE if on or (subindex and self.objects[index, 0]) else None
        return None


def with_bit_30(folder: Path, entry: str = "$NODEID+0x40000180") -> Path:
    text = data_file("inverter.eds").read_text(encoding="utf-8")
    assert text.count("$NODEID+0x180") == 1
    path = folder / "drive.eds"
    path.write_text(text.replace("$NODEID+0x180", entry), encoding="utf-8")
    return path


@pytest.mark.parametrize("in_eds", [False, True])
@pytest.mark.parametrize("drive_type", [NoRemoteFrames, SetsBit30, ClearsBit30, Strict])
def test_bit_30_of_a_cob_id_is_the_drive_s(drive_type: type[FakeDrive], in_eds: bool, tmp_path: Path) -> None:
    with on_bus(drive_type, eds_path=with_bit_30(tmp_path) if in_eds else None) as (drive, inverter, link):
        inverter.configure()
        inverter.arm()
        inverter.command(guarded(60.0))
        feedback = inverter.await_feedback(link.sync(), 5.0)
        assert feedback is not None
        assert feedback.torque_nm == 60.0
        inverter.disarm()
        assert inverter.check() == ()
        assert drive.objects[0x1800, 1] & 0x7FF == 0x180 + M1.node_id


def test_cob_id_that_the_drive_had_before_is_switched_off_as_it_is() -> None:
    """Bits 0 to 29 do not change while the PDO is on, an identifier of 29 bits included."""
    with on_bus(Strict) as (drive, inverter, _):
        drive.objects[0x1800, 1] = 1 << 29 | 0x12345
        assert inverter.check() == ()
        [remark] = inverter.remarks()
        assert "(of 29 bits)" in remark
        inverter.configure()
        assert drive.objects[0x1800, 1] == 0x180 + M1.node_id


def test_pdo_of_29_bits_in_the_eds_is_given_an_identifier_of_11(tmp_path: Path) -> None:
    with on_bus(eds_path=with_bit_30(tmp_path, "$NODEID+0x20000180")) as (drive, inverter, _):
        drive.objects[0x1800, 1] = 1 << 29 | 0x180 + M1.node_id
        assert inverter.check() == ()
        [remark] = inverter.remarks()
        assert "(of 29 bits)" in remark
        inverter.configure()
        assert drive.objects[0x1800, 1] == 0x180 + M1.node_id


class DeafAtFirst(FakeDrive):
    """Does not take START while it still writes what it was given (CANopenNode#26)."""

    starts = 0

    def take_nmt(self, command: int) -> None:
        self.starts += command == 1
        if command != 1 or self.starts > 2:
            super().take_nmt(command)


def test_start_is_sent_again_until_the_heartbeat_says_operational() -> None:
    with on_bus(DeafAtFirst, replace(M1, state_timeout_s=5.0)) as (drive, inverter, _):
        inverter.configure()
        assert drive.nmt is NmtState.OPERATIONAL
        assert isinstance(drive, DeafAtFirst)
        assert drive.starts == 3


class ShowsNoModeAtFirst(FakeDrive):
    """Shows mode -1 for some seconds before the one it was given (ros_canopen#457)."""

    looks = 0

    def read(self, index: int, subindex: int) -> int:
        if index == 0x6061:
            self.looks += 1
            return -1 if self.looks < 20 else super().read(index, subindex)
        return super().read(index, subindex)


def test_mode_may_take_the_time_that_the_rig_file_gives_it() -> None:
    with on_bus(ShowsNoModeAtFirst, replace(M1, mode_timeout_s=30.0)) as (drive, inverter, _):
        inverter.configure()
        inverter.arm()
        assert drive.state is PowerState.OPERATION_ENABLED


def test_mode_that_takes_longer_is_refused_with_what_it_shows() -> None:
    with on_bus(ShowsNoModeAtFirst, replace(M1, mode_timeout_s=0.001)) as (_, inverter, _link):
        inverter.configure()
        with pytest.raises(DeviceTimeout, match=r"mode of operation is -1 after 0\.001 s"):
            inverter.arm()


@pytest.mark.parametrize(
    ("number", "data"),
    [
        (0x181, bytes.fromhex("08 00 08 00 08 00 08 00")),  # as a TPDO that reports a fault
        (0x081, bytes.fromhex("10 23 01 00 00 00 00 00")),  # as an EMCY
        (0x701, b"\x04"),  # as a heartbeat of a node that is stopped
        (0x701, b"\x99"),  # as a heartbeat that is none
        (0x581, b"\x60"),  # as an SDO answer cut short
    ],
)
@pytest.mark.parametrize("kind", ["extended", "fd"])
def test_frames_of_another_protocol_are_none_of_ours(number: int, data: bytes, kind: str) -> None:
    """A frame of 29 bits, or of CAN FD, whose identifier has the same number as one of the drive's."""
    number += M1.node_id - 1
    with bench() as rig:
        rig.m1.configure()
        rig.m1.arm()
        with rig.intruder() as bus:
            for _ in range(3):
                before = rig.cycle(guarded(60.0))
                bus.send(
                    can.Message(arbitration_id=number, data=data, is_extended_id=kind == "extended", is_fd=kind == "fd")
                )
                assert rig.m1.latest is before
                rig.m1.raise_if_faulted()
        rig.m1.disarm()


def driven(inverter: Inverter, link: CanLink, cycles: int, torque_nm: float = 60.0) -> None:
    for n in range(cycles):
        inverter.command(guarded(torque_nm if n % 4 < 2 else -torque_nm))
        assert inverter.await_feedback(link.sync(), 5.0) is not None
        inverter.raise_if_faulted()


def test_internal_limit_is_part_of_the_feedback() -> None:
    with on_bus() as (drive, inverter, link):
        inverter.configure()
        inverter.arm()
        driven(inverter, link, 2)
        assert inverter.latest is not None
        assert not inverter.latest.limited
        drive.status_bits |= StatusBit.INTERNAL_LIMIT_ACTIVE
        driven(inverter, link, 2)
        assert inverter.latest.limited


@pytest.mark.parametrize("state", [PowerState.READY_TO_SWITCH_ON, PowerState.SWITCHED_ON, PowerState.QUICK_STOP_ACTIVE])
def test_a_drive_that_left_its_state_is_not_enabled_again(state: PowerState) -> None:
    with on_bus() as (drive, inverter, link):
        inverter.configure()
        inverter.arm()
        driven(inverter, link, 2)
        drive.state, drive.pending = state, {}  # as by an enable input, with the RPDO under way lost
        assert inverter.await_feedback(link.sync(), 5.0) is not None
        with pytest.raises(DeviceFault, match=rf"power state is {state.value} after controlword 0x000F .*not enabled"):
            inverter.command(guarded(60.0))
        link.sync()
        assert drive.state is state
        inverter.disarm()
        inverter.arm()  # another run may
        driven(inverter, link, 2)
        assert drive.state is PowerState.OPERATION_ENABLED
