"""Cycles the host was too late for: their rows are there, flagged, and time goes on evenly."""

from __future__ import annotations

from hil.rig.drive import SLEPT_THROUGH
from hil.rig.pacing import FreePacer, Tick
from hil.rig.sample import SampleFlag
from tests.rig.observer import assert_disarmed
from tests.rig.serving import Samples, fast, run_once, served

GAP_AFTER = 250
"""A cycle inside the measured part of the small rig's reversal."""


class SleepyPacer:
    """Simulated time with one gap: three cycles after ``GAP_AFTER`` are left out, as in sleep."""

    def __init__(self, pacer: FreePacer) -> None:
        self._pacer = pacer
        self.period_ns = pacer.period_ns
        self.answer_timeout_s = pacer.answer_timeout_s
        self.poll_patience_s = pacer.poll_patience_s

    def next(self) -> Tick:
        tick = self._pacer.next()
        gap = 3 if tick.cycle > GAP_AFTER else 0
        late_ns = gap * self.period_ns if tick.cycle == GAP_AFTER else 0
        return Tick(tick.cycle + gap, tick.due_ns + gap * self.period_ns, late_ns)


def test_missing_cycles_become_flagged_rows() -> None:
    samples = Samples()
    with served() as (server, rig):
        summary = run_once(rig, samples, experiment="reversal", pacer=SleepyPacer(fast(rig)))
        assert_disarmed(server.bus_url, 1, 2)
    assert samples.column("time_s") == [k / 100 for k in range(len(samples.rows))]
    stand_ins = [row for row in samples.rows if row.flags is SLEPT_THROUGH]
    assert [row.cycle for row in stand_ins] == [GAP_AFTER + 1, GAP_AFTER + 2, GAP_AFTER + 3]
    assert [row.age_ns for row in stand_ins] == [10_000_000, 20_000_000, 30_000_000]
    last_real = next(row for row in samples.rows if row.cycle == GAP_AFTER)
    assert {row.speed_rad_s for row in stand_ins} == {last_real.speed_rad_s}
    assert {row.torque_ref_nm for row in stand_ins} == {last_real.torque_ref_nm}
    assert summary.flagged == len([row for row in samples.rows if row.flags is not SampleFlag.GOOD])
