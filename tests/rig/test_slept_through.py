"""Cycles the host was too late for: their rows are there, flagged, and time advances evenly."""

from itertools import pairwise

import pytest

from drivers.errors import DeviceFault
from hil.errors import RunAborted
from hil.rig.drive import SLEPT_THROUGH
from hil.rig.pacing import FreePacer, Tick
from hil.sample import SampleFlag
from hil.simulator.fault_table import rig_faults
from tests.rig.observer import assert_disarmed
from tests.rig.serving import Samples, fast, run_once, served, small_rig

GAP_AFTER = 250
"""A cycle inside the measured part of the small rig's reversal."""


class SleepyPacer:
    """Simulated time with one gap: some cycles after ``GAP_AFTER`` are left out, as in sleep."""

    def __init__(self, pacer: FreePacer, gap: int = 3) -> None:
        self._pacer = pacer
        self._gap = gap
        self.period_ns = pacer.period_ns
        self.answer_timeout_s = pacer.answer_timeout_s
        self.poll_patience_s = pacer.poll_patience_s

    def next(self) -> Tick:
        tick = self._pacer.next()
        gap = self._gap if tick.cycle > GAP_AFTER else 0
        late_ns = self._gap * self.period_ns if tick.cycle == GAP_AFTER else 0
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


def test_a_stall_of_this_machine_is_this_machines_fault() -> None:
    """After two seconds the PLC's last answer is old as well; it is not to blame."""
    with served() as (server, rig):
        with pytest.raises(RunAborted, match=r"cycle 250 began 2\.000 s late, .* This machine was too busy"):
            run_once(rig, Samples(), experiment="reversal", pacer=SleepyPacer(fast(rig), gap=200))
        assert_disarmed(server.bus_url, 1, 2)


def test_what_ends_a_run_soon_after_this_machine_was_late_is_reported_after_it() -> None:
    rig = small_rig()
    for at_s, first in (
        (2.6, "This machine was too busy within the last second: cycle 250 began 0.030 s late"),
        (2.4, "inverter m2"),
    ):
        with served(rig, rig_faults([f"m2.emcy@{at_s}=0x4210"], rig.period_s)) as (_, at):
            with pytest.raises(DeviceFault, match=f"^{first}.*EMCY 0x4210"):
                run_once(at, Samples(), experiment="reversal", pacer=SleepyPacer(fast(at)))


@pytest.mark.parametrize("gap_after", range(210, 290, 20))
def test_after_missing_cycles_the_torque_continues_from_what_the_drives_hold(
    gap_after: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The plan has continued for 15 cycles at up to 2000 Nm/s, 0.65 of it on m1; the torque has not."""
    monkeypatch.setattr("tests.rig.test_slept_through.GAP_AFTER", gap_after)
    samples = Samples()
    with served() as (_, rig):
        run_once(rig, samples, experiment="reversal", pacer=SleepyPacer(fast(rig), gap=15))
    driven = [row for row in samples.rows if row.flags is not SLEPT_THROUGH]
    assert len(driven) < len(samples.rows)
    largest_nm = rig.guard.rate_limit_nm_per_s * rig.period_s + rig.prbs.amplitude_nm
    steps_nm = [abs(b.torque_ref_m1_nm - a.torque_ref_m1_nm) for a, b in pairwise(driven)]
    assert max(steps_nm) <= largest_nm + 1e-6
