"""The two clocks of a run, and what both promise."""

import itertools
import time

import pytest

from hil.rig.build import open_devices
from hil.rig.pacing import FREE_PATIENCE_S, FreePacer, RealTimePacer, Tick, device_patience_s
from tests.rig.serving import changed, served, small_rig

MS = 1_000_000


def test_simulated_time_is_cycles_times_period() -> None:
    pacer = FreePacer(10 * MS)
    assert [pacer.next() for _ in range(3)] == [Tick(0, 0, 0), Tick(1, 10 * MS, 0), Tick(2, 20 * MS, 0)]


def test_real_time_never_begins_a_cycle_before_it_is_due() -> None:
    pacer = RealTimePacer(1 * MS)
    ticks = [pacer.next() for _ in range(20)]
    origin_ns = ticks[0].now_ns
    for tick in ticks:
        assert tick.now_ns - tick.late_ns == origin_ns + tick.cycle * MS
        assert tick.late_ns >= 0


def test_real_time_keeps_half_a_period_between_cycles() -> None:
    pacer = RealTimePacer(1 * MS)
    ticks = [pacer.next() for _ in range(20)]
    for before, after in itertools.pairwise(ticks):
        assert after.now_ns - before.now_ns >= MS // 2


def test_cycles_the_host_slept_through_are_left_out_not_caught_up() -> None:
    pacer = RealTimePacer(1 * MS)
    first = pacer.next()
    while time.monotonic_ns() < first.now_ns + 10 * MS:
        pass
    late = pacer.next()
    after = pacer.next()
    assert late.cycle == 1
    assert late.late_ns >= 9 * MS
    assert after.cycle >= 11
    assert after.now_ns - after.late_ns == first.now_ns + after.cycle * MS


@pytest.mark.parametrize("pacer", [FreePacer(10 * MS), RealTimePacer(10 * MS)])
def test_answer_timeout_is_positive_and_period_is_kept(pacer: FreePacer | RealTimePacer) -> None:
    assert pacer.period_ns == 10 * MS
    assert pacer.answer_timeout_s > 0.0


def test_devices_and_host_wait_longer_for_each_other_where_no_clock_is_kept() -> None:
    """Its cycles use a processor up, and the machine may be busy: a late answer decides no run."""
    assert device_patience_s(RealTimePacer(10 * MS)) == 0
    free = device_patience_s(FreePacer(10 * MS))
    rig = changed(small_rig(), {"inverters.m1": {"host_timeout_ms": 150}})
    with served(rig) as (_, at), open_devices(at, free) as devices:
        assert devices.m1.settings.host_timeout_ms == FREE_PATIENCE_S * 1000
    with served(rig) as (_, at), open_devices(at) as devices:
        assert devices.m1.settings.host_timeout_ms == 150
