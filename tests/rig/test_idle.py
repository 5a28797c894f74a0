"""Listening: live values from drives that stay disarmed, whoever is missing."""

import math
from pathlib import Path

import pytest

from drivers.errors import BusDown
from hil.rig.build import open_devices
from hil.rig.idle import Listening
from hil.rig.timing import RunTiming
from hil.sample import SampleFlag
from hil.simulator.faults import InverterFaults, RigFaults
from tests.rig.sensed import sensed_rig, served_with_sensors
from tests.rig.serving import fast, served


def test_channels_are_read_at_rest_too(tmp_path: Path) -> None:
    rig = sensed_rig(tmp_path)
    with served_with_sensors(rig) as at, open_devices(at) as devices:
        listening = Listening(devices, fast(at), RunTiming(10_000_000))
        listening.begin()
        samples = [listening.step() for _ in range(20)]
        listening.plc.finish()
    assert {len(sample.channels) for sample in samples} == {len(rig.channels)}
    assert all(map(math.isfinite, samples[-1].channels))
    lost = [any(map(math.isnan, sample.channels)) for sample in samples]
    assert lost == [SampleFlag.CHANNEL_LOST in sample.flags for sample in samples]


def test_a_missing_drive_is_reported_and_the_other_is_heard() -> None:
    faults = RigFaults(m2=InverterFaults(absent=True))
    with served(faults=faults) as (_, rig), open_devices(rig) as devices:
        listening = Listening(devices, fast(rig, answer_timeout_s=0.05), RunTiming(10_000_000))
        listening.begin()
        sample = listening.step()
        trouble_m1, trouble_m2 = listening.troubles
        listening.plc.finish()
    assert trouble_m1 is None
    assert "m2" in str(trouble_m2)
    assert sample.flags is SampleFlag.M2_STALE
    assert math.isfinite(sample.torque_m1_nm)
    assert math.isnan(sample.torque_m2_nm)


def test_a_lost_bus_ends_it() -> None:
    with served() as (_, rig), open_devices(rig) as devices:
        listening = Listening(devices, fast(rig), RunTiming(10_000_000))
        listening.begin()
        listening.step()
        listening.plc.finish()
        devices.link.close()
        with pytest.raises(BusDown):
            listening.step()


def test_a_plc_that_went_is_connected_again() -> None:
    with served() as (_, rig), open_devices(rig) as devices:
        listening = Listening(devices, fast(rig), RunTiming(10_000_000))
        listening.begin()
        devices.plc.close()
        seen = []
        for _ in range(3000):
            sample = listening.step()
            seen.append(listening.plc.trouble)
            if seen[-1] is None and any(seen):
                break
            devices.plc_loop.call(_moment())
        listening.plc.finish()
        assert any(seen)
        assert seen[-1] is None
        assert sample.cycle < 3000


async def _moment() -> None:
    """Give the PLC's loop a turn."""
