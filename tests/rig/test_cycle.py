"""One exchange with both inverters: lost answers are flagged samples, and too many of them end the run."""

import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise

import pytest

from drivers.canopen.can_link import CanLink
from drivers.errors import CommandRefused, DeviceTimeout
from drivers.torque_guard import TorqueRequest
from hil.errors import RunAborted
from hil.rig.arming import ArmedDrives
from hil.rig.build import Devices, open_devices
from hil.rig.cycle import Cycle
from hil.rig.excitation import NO_TORQUE
from hil.rig.pacing import FreePacer, Tick
from hil.rig.stop import StopRequest
from hil.sample import SampleFlag
from tests.rig.serving import served

MS = 1_000_000
PERIOD_NS = 10 * MS
M2 = 2
OPERATIONAL = 5


def answer_every(syncs: int, link: CanLink) -> None:
    """Have inverter m2 send its TPDO at every n-th SYNC: transmission type, 0x1800:02 (CiA 301, 7.5.2.37)."""
    operational, answered = threading.Event(), threading.Event()
    link.subscribe(0x580 + M2, lambda data, t_ns: answered.set())
    link.subscribe(0x700 + M2, lambda data, t_ns: operational.set() if data[0] == OPERATIONAL else None)
    link.send(0x000, bytes((0x80, M2)))  # PRE-OPERATIONAL: a mapping in use can't be changed
    link.send(0x600 + M2, bytes((0x2F, 0x00, 0x18, 0x02, syncs, 0, 0, 0)))
    assert answered.wait(60.0)
    operational.clear()
    link.send(0x000, bytes((0x01, M2)))
    assert operational.wait(60.0)


@contextmanager
def armed(syncs: int = 1, answer_timeout_s: float = 2.0) -> Iterator[tuple[Devices, Cycle]]:
    with served() as (_, rig), open_devices(rig) as devices:
        devices.m1.configure()
        devices.m2.configure()
        answer_every(syncs, devices.link)
        with ArmedDrives(devices, StopRequest()):
            yield (
                devices,
                Cycle(devices, PERIOD_NS, answer_timeout_s),
            )


def test_lost_answer_is_a_flagged_sample_with_the_last_value() -> None:
    pacer = FreePacer(PERIOD_NS)
    with armed(syncs=2) as (devices, cycle):
        samples = [cycle.step(pacer.next(), NO_TORQUE, 0.0, SampleFlag.GOOD) for _ in range(2)]
        devices.guard.enable()
        for base_nm in (0.0, 6.0, 12.0, 18.0, 24.0):
            request = TorqueRequest(0.0, 0.0, base_nm, 0.0)
            samples.append(cycle.step(pacer.next(), request, 0.0, SampleFlag.GOOD))
    flags = [sample.flags for sample in samples]
    assert set(flags) == {SampleFlag.GOOD, SampleFlag.M2_STALE}
    assert all(one is not other for one, other in pairwise(flags))
    for before, after in pairwise(samples):
        if after.flags is SampleFlag.M2_STALE:
            assert after.torque_m2_nm == before.torque_m2_nm
            assert (before.age_ns, after.age_ns) == (0, PERIOD_NS)


def test_answers_missing_for_the_feedback_timeout_end_the_run() -> None:
    pacer = FreePacer(PERIOD_NS)
    with armed(syncs=40, answer_timeout_s=0.05) as (_, cycle):
        for _ in range(21):
            cycle.step(pacer.next(), NO_TORQUE, 0.0, SampleFlag.GOOD)
        with pytest.raises(DeviceTimeout, match=r"inverter m2: no TPDO for 0\.210 s, .* more than 0\.2 s"):
            cycle.step(pacer.next(), NO_TORQUE, 0.0, SampleFlag.GOOD)


def test_guard_stands_between_request_and_inverter() -> None:
    pacer = FreePacer(PERIOD_NS)
    with armed() as (devices, cycle):
        with pytest.raises(CommandRefused, match="while not enabled"):
            cycle.step(pacer.next(), TorqueRequest(1.0, 0.0, 0.0, 0.0), 0.0, SampleFlag.GOOD)
        cycle.step(pacer.next(), NO_TORQUE, 0.0, SampleFlag.GOOD)
        assert cycle.answered
        devices.guard.enable()
        cycle.step(pacer.next(), NO_TORQUE, 0.0, SampleFlag.GOOD)
        with pytest.raises(CommandRefused, match=r"base torque goes from 0 Nm to 100 Nm in 0\.01 s"):
            cycle.step(pacer.next(), TorqueRequest(100.0, 0.0, 0.0, 0.0), 0.0, SampleFlag.GOOD)


def test_host_that_stalls_blames_itself() -> None:
    with armed() as (_, cycle):
        cycle.step(Tick(0, 0, 0), NO_TORQUE, 0.0, SampleFlag.GOOD)
        with pytest.raises(RunAborted, match=r"cycle 1 began 0\.200 s late.*machine was too busy"):
            cycle.step(Tick(1, PERIOD_NS, 200 * MS), NO_TORQUE, 0.0, SampleFlag.GOOD)


def test_the_speed_compared_with_limits_is_the_faster_of_both_readings() -> None:
    pacer = FreePacer(PERIOD_NS)
    with armed(syncs=2) as (_, cycle):
        assert math.isnan(cycle.fastest_rad_s)
        for _ in range(2):
            cycle.step(pacer.next(), NO_TORQUE, 0.0, SampleFlag.GOOD)
        assert cycle.answered
        for m1, m2, fastest in ((1.0, -5.0, -5.0), (-5.0, 1.0, -5.0), (3.0, 2.0, 3.0)):
            cycle._m1.speed_rad_s, cycle._m2.speed_rad_s = m1, m2
            assert cycle.fastest_rad_s == fastest
        cycle._m2.speed_rad_s = math.nan
        assert math.isnan(cycle.fastest_rad_s)
