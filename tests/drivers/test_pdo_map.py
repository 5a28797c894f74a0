"""PDO layouts and frames: packed at the limits, refused beyond, compared with the objects they come from."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from drivers.canopen.can_link import CanLink
from drivers.canopen.pdo_map import MappedObject, PdoCodec, PdoLayout, read_layout
from drivers.errors import CommandRefused, ConfigMismatch, ProtocolViolation
from drivers.inverter.inverter import Inverter
from drivers.inverter.settings import Acceptance
from drivers.scaling import IntegerType
from hil.rig.replay import replay
from tests.drivers.can_bench import M1, guarded
from tests.drivers.fake_drive import FakeDrive, on_bus
from tests.drivers.maker_files import APART, PREDEFINED, Maker
from tests.drivers.maker_rig import written_rig
from tests.rig.serving import CHANGES, changed
from tests.wire.traced import traced_run

TYPES = {
    (0x6041, 0): IntegerType.UNSIGNED16,
    (0x6077, 0): IntegerType.INTEGER16,
    (0x606C, 0): IntegerType.INTEGER32,
    (0x6061, 0): IntegerType.INTEGER8,
}
TPDO = PdoLayout(
    0x1800,
    0x1A00,
    0x185,
    valid=True,
    transmission_type=1,
    objects=(MappedObject(0x6041, 0, 16), MappedObject(0x6077, 0, 16), MappedObject(0x606C, 0, 32)),
)


def codec(*objects: MappedObject) -> PdoCodec:
    return PdoCodec(PdoLayout(0x1800, 0x1A00, 0x185, True, 1, objects or TPDO.objects), TYPES, "node 5")


def test_frame_is_little_endian_in_mapping_order() -> None:
    data = codec().pack((0x0637, -2, 0x01020304))
    assert data == bytes.fromhex("37 06 fe ff 04 03 02 01")
    assert codec().unpack(data) == (0x0637, -2, 0x01020304)


@given(st.integers(0, 0xFFFF), st.integers(-32768, 32767), st.integers(-(2**31), 2**31 - 1))
def test_every_value_survives_the_frame(statusword: int, torque: int, speed: int) -> None:
    values = (statusword, torque, speed)
    assert codec().unpack(codec().pack(values)) == values


@pytest.mark.parametrize(
    "values", [(-1, 0, 0), (0x10000, 0, 0), (0, 32768, 0), (0, -32769, 0), (0, 0, 2**31), (0, 0), (0, 0, 0, 0)]
)
def test_values_that_do_not_fit_are_refused(values: tuple[int, ...]) -> None:
    with pytest.raises(CommandRefused, match=r"node 5: PDO 0x1800 .* do not fit the objects"):
        codec().pack(values)


@pytest.mark.parametrize("length", [0, 7, 9])
def test_frame_of_another_length_is_refused(length: int) -> None:
    with pytest.raises(ProtocolViolation, match=f"frame of {length} bytes, expected 8"):
        codec().unpack(bytes(length))


@pytest.mark.parametrize(
    ("mapped", "expected"),
    [
        (MappedObject(0x6062, 0, 32), "an integer object of the EDS"),
        (MappedObject(0x6077, 0, 32), r"16 bit \(INTEGER16\)"),
    ],
)
def test_mapping_that_contradicts_the_types_is_refused(mapped: MappedObject, expected: str) -> None:
    with pytest.raises(ConfigMismatch, match=f"maps 0x{mapped.index:04X}.*expected {expected}"):
        codec(mapped)


@pytest.mark.parametrize("valid", [True, False])
def test_layout_is_read_from_its_objects(valid: bool) -> None:
    objects = {
        (0x1800, 1): 0x185 | (0 if valid else 1 << 31),
        (0x1800, 2): 1,
        (0x1A00, 0): 3,
        (0x1A00, 1): 0x60410010,
        (0x1A00, 2): 0x60770010,
        (0x1A00, 3): 0x606C0020,
    }
    layout = read_layout(lambda index, subindex: objects[index, subindex], 0x1800, 0x1A00)
    assert layout == PdoLayout(0x1800, 0x1A00, 0x185, valid, 1, TPDO.objects)
    assert ("switched off" in str(layout)) is not valid


ACCEPTED = replace(M1, accepted={"rpdo_deadline": Acceptance("A. Nyone", "a relay of its own")})
SPEED = 0x606C


class Counts(FakeDrive):
    """Its speed counts the cycles."""

    def take_sync(self, data: bytes) -> None:
        self.objects[SPEED, 0] += 1
        super().take_sync(data)


class Backwards(Counts):
    """Sends its TPDOs in another order than that of their numbers."""

    def tpdos_sent(self) -> Sequence[PdoCodec]:
        return self.tpdos[::-1]


class LosesOne(Counts):
    """Of every third cycle a TPDO is lost, each time another."""

    def tpdos_sent(self) -> Sequence[PdoCodec]:
        cycle = self.objects[SPEED, 0]
        lost = cycle // 3 % len(self.tpdos) if cycle % 3 == 0 else None
        return [codec for n, codec in enumerate(self.tpdos) if n != lost]


@contextmanager
def armed(maker: Maker, drive_type: type[FakeDrive], folder: Path) -> Iterator[tuple[FakeDrive, Inverter, CanLink]]:
    path = folder / "drive.eds"
    path.write_text(maker.text(), encoding="latin-1")
    with on_bus(drive_type, ACCEPTED, path) as (drive, inverter, link):
        inverter.configure()
        inverter.arm()
        yield drive, inverter, link
        inverter.disarm()


@pytest.mark.parametrize("drive_type", [Counts, Backwards])
@pytest.mark.parametrize("maker", [PREDEFINED, APART])
def test_command_and_feedback_in_several_pdos(maker: Maker, drive_type: type[FakeDrive], tmp_path: Path) -> None:
    with armed(maker, drive_type, tmp_path) as (drive, inverter, link):
        for cycle in range(1, 20):
            inverter.command(guarded(6.0 * cycle))
            feedback = inverter.await_feedback(link.sync(), 1.0)
            assert feedback is not None
            assert (feedback.torque_raw, feedback.speed_raw) == (10 * cycle, drive.objects[SPEED, 0])
            inverter.raise_if_faulted()


def test_cycle_of_which_a_tpdo_is_lost_has_no_feedback(tmp_path: Path) -> None:
    with armed(APART, LosesOne, tmp_path) as (drive, inverter, link):
        answered = []
        for cycle in range(1, 20):
            inverter.command(guarded(6.0 * cycle))
            feedback = inverter.await_feedback(link.sync(), 0.01)
            answered.append(drive.objects[SPEED, 0] % 3 != 0)
            assert (feedback is not None) == answered[-1]
            if feedback is not None:
                assert (feedback.torque_raw, feedback.speed_raw) == (10 * cycle, drive.objects[SPEED, 0])
        assert answered.count(False) == 6


def test_replay_of_a_trace_gives_the_samples_of_the_run(tmp_path: Path) -> None:
    eds, path = tmp_path / "drive.eds", tmp_path / "run.blf"
    eds.write_text(APART.text(), encoding="latin-1")
    noisy = {"simulation": {"speed_noise_rad_s": 0.05, "torque_noise_permille": 2.0}}
    rig = changed(written_rig(eds, tmp_path), CHANGES | noisy)
    live, again = (
        [(row.torque_m1_nm, row.torque_m2_nm, row.speed_rad_s, row.flags) for row in rows]
        for rows in (traced_run(path, rig).rows, replay(path, rig, whole=True))
    )
    assert len(set(live)) > len(live) // 2
    assert any(again[n : n + len(live)] == live for n in range(len(again)))
