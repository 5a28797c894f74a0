"""The PLC as the cycle sees it: polled next to it, aged in its time, judged in every cycle."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from hil.errors import RunAborted
from hil.rig.build import open_devices
from hil.rig.pacing import Tick
from hil.rig.plc_watch import Needs, PlcWatch
from hil.sample import SampleFlag
from hil.simulator.rig_server import RigServer
from tests.rig.serving import served

MS = 1_000_000


@contextmanager
def watch(patience_s: float) -> Iterator[tuple[RigServer, PlcWatch]]:
    with served() as (server, rig), open_devices(rig) as devices:
        before = devices.plc_loop.call(devices.plc.read_status())
        yield server, PlcWatch(devices.plc_loop, devices.plc, before, Needs(0.0), patience_s)


def at(time_ms: int) -> Tick:
    return Tick(time_ms // 10, time_ms * MS, 0)


def test_status_is_as_old_as_its_poll_in_the_time_of_the_cycle() -> None:
    with watch(patience_s=5.0) as (_, plc_watch):
        ages = []
        for time_ms in range(0, 210, 10):
            plc_watch.look(at(time_ms), 0.0)
            ages.append(plc_watch.status.age_ns(time_ms * MS) // MS)
    assert ages == [*range(0, 100, 10), *range(0, 100, 10), 0]


def test_news_is_there_in_the_cycle_it_came_in_and_in_no_other() -> None:
    with watch(patience_s=5.0) as (_, plc_watch):
        got = []
        for time_ms in range(0, 210, 10):
            plc_watch.look(at(time_ms), 0.0)
            got.append(plc_watch.news is not None)
            assert plc_watch.news in (None, plc_watch.status)
    assert [10 * k for k, news in enumerate(got) if news] == [0, 100, 200]


def test_silent_plc_is_first_stale_then_the_end() -> None:
    with watch(patience_s=0.0) as (server, plc_watch):
        server.plc_server.pause()
        assert plc_watch.look(at(0), 0.0) is SampleFlag.GOOD
        assert plc_watch.look(at(200), 0.0) is SampleFlag.GOOD
        assert plc_watch.look(at(210), 0.0) is SampleFlag.PLC_STALE
        assert plc_watch.look(at(1000), 0.0) is SampleFlag.PLC_STALE
        with pytest.raises(RunAborted, match=r"PLC: no answer for 1\.01 s, expected one every 0\.1 s"):
            plc_watch.look(at(1010), 0.0)


def test_poll_that_fails_ends_the_run_with_its_reason() -> None:
    with watch(patience_s=5.0) as (server, plc_watch):
        server.plc_server.pause()
        with pytest.raises(RunAborted, match="PLC: expected its status, got: PLC at 127"):
            plc_watch.look(at(0), 0.0)


@pytest.mark.parametrize("speeds_rad_s", [(-320.1, 0.0), (0.0, 320.1), (320.1, 320.1), (float("nan"), 320.1)])
def test_speed_above_what_the_plc_permits_by_either_reading(speeds_rad_s: tuple[float, float]) -> None:
    with watch(patience_s=5.0) as (_, plc_watch):
        plc_watch.look(at(0), 320.0, -320.0)
        m1, m2 = speeds_rad_s
        with pytest.raises(RunAborted, match=f"speed is {m1:.1f} and {m2:.1f} rad/s, expected at most 320 rad/s"):
            plc_watch.look(at(10), *speeds_rad_s)
