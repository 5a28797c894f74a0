"""Drives whose fixed PDOs share command and feedback: read in one cycle, and only what is all of that cycle."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.canopen.can_link import CanLink
from drivers.canopen.pdo_map import PdoCodec
from drivers.inverter.inverter import Inverter
from drivers.inverter.settings import Acceptance
from hil.rig.replay import replay
from tests.drivers.can_bench import M1, guarded
from tests.drivers.fake_drive import FakeDrive, on_bus
from tests.drivers.maker_files import APART, PREDEFINED, Maker
from tests.drivers.maker_rig import written_rig
from tests.rig.serving import CHANGES, changed
from tests.wire.traced import traced_run

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
