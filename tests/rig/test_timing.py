"""Timing of a run: its record, the shortest period, and cycles that this machine slept through."""

import json
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from drivers.errors import DeviceFault
from hil.cli.main import run as hil
from hil.config.rig_file import Rig, read_rig
from hil.errors import RunAborted
from hil.recording.formats import read_table
from hil.rig.drive import SLEPT_THROUGH
from hil.rig.pacing import FreePacer, RealTimePacer, Tick, period_ns
from hil.rig.timing import Histogram, RunTiming, timing_lines
from hil.sample import SampleFlag
from hil.simulator.fault_table import rig_faults
from tests.rig.observer import assert_disarmed
from tests.rig.serving import EXAMPLE, Samples, addresses, changed, fast, run_once, served, small_rig

MS = 1_000_000


def test_period_lateness_and_missed_cycles_are_counted() -> None:
    timing = RunTiming(10 * MS)
    for tick in (Tick(0, 0, 0), Tick(1, 10 * MS, 6 * MS), Tick(4, 40 * MS, 1 * MS)):
        timing.begin(tick, tick.now_ns)
    assert (timing.cycles, timing.missed, timing.late) == (3, 2, 1)
    assert timing.lateness.max_ns == 6 * MS
    assert timing.period.max_ns == 25 * MS
    assert timing.period.total == 2


def test_document_has_the_histograms_and_their_quantiles() -> None:
    timing = RunTiming(10 * MS)
    for cycle in range(100):
        timing.begin(Tick(cycle, cycle * 10 * MS, cycle), cycle * 10 * MS)
    document = timing.as_json()
    assert document["schema"] == "hil.timing/1"
    assert document["lateness"]["p50_s"] == 49e-9
    assert document["lateness"]["max_s"] == 99e-9
    assert document["period"]["bins"][0][1] == 99
    assert document["reply_age"]["p99.9_s"] is None
    assert len(timing_lines(timing)) == 5


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_recording_keeps_timing_and_what_the_system_gave(
    tmp_path: Path, suffix: str, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / f"run{suffix}"
    printed = run_reversal(tmp_path, out, capsys, "--pace", "fast")
    metadata = read_table(out).metadata
    timing = json.loads(metadata["timing"])
    assert timing == printed["timing"]
    assert timing["period"]["count"] == timing["cycles"] - 1
    assert timing["reply_age"]["count"] + timing["unanswered"] == 2 * timing["cycles"]
    assert metadata["pace"] == "fast"
    assert not json.loads(metadata["real_time"])["scheduling"]["given"]


@pytest.mark.campaign
def test_real_time_run_says_what_was_granted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "run.csv"
    printed = run_reversal(tmp_path, out, capsys, "--pace", "real")
    granted = printed["real_time"]
    assert set(granted) == {"scheduling", "memory", "timer_slack"}
    assert all("granted" in grant["statement"] for grant in granted.values())
    assert json.loads(read_table(out).metadata["real_time"]) == granted


def run_reversal(folder: Path, out: Path, capsys: pytest.CaptureFixture[str], *options: str) -> dict[str, Any]:
    """Run the example's reversal, short and near standstill."""
    text = EXAMPLE.read_text(encoding="utf-8")
    for before, after in (
        ("turning_speed_rad_s = 6.0", "turning_speed_rad_s = 0.2"),
        ("feedback_timeout_s = 0.2", "feedback_timeout_s = 5.0"),  # a test machine may be busy
        ('kind = "reversal"\nduration_s = 30.0', 'kind = "reversal"\nduration_s = 0.5'),
    ):
        assert text.count(before) == 1
        text = text.replace(before, after)
    file = folder / "rig.toml"
    file.write_text(text, encoding="utf-8")
    with served(read_rig(file)) as (server, _):
        assert hil(["run", str(file), "reversal", "--out", str(out), "--json", *addresses(server), *options]) == 0
    document: dict[str, Any] = json.loads(capsys.readouterr().out)
    return document


WIDEST = 1.0 / 128.0


def filled(times_ns: list[int]) -> Histogram:
    histogram = Histogram()
    for time_ns in times_ns:
        histogram.add(time_ns)
    return histogram


@given(st.lists(st.integers(0, 10**12), min_size=1, max_size=200), st.sampled_from((0.01, 0.5, 0.99, 0.999, 1.0)))
def test_quantile_is_the_nearest_rank_or_slightly_more(times_ns: list[int], share: float) -> None:
    exact = sorted(times_ns)[max(1, math.ceil(share * len(times_ns))) - 1]
    reported = filled(times_ns).quantile_ns(share)
    assert reported is not None
    assert exact <= reported <= exact * (1.0 + WIDEST) + 1e-9
    assert reported <= max(times_ns)


def test_the_longest_time_is_exact_and_nothing_is_lost() -> None:
    times_ns = [round(x) for x in np.random.default_rng(3).lognormal(13.0, 3.0, 5000)]
    histogram = filled(times_ns)
    assert histogram.max_ns == max(times_ns)
    assert histogram.total == sum(count for _, count in histogram.bins()) == 5000
    edges = [edge for edge, _ in histogram.bins()]
    assert edges == sorted(set(edges))


PERIOD_S = 0.001
DURATION_S = 0.2


def rig_at_one_millisecond() -> Rig:
    quick = {"duration_s": DURATION_S, "turning_speed_rad_s": 0.2}
    patient = {"feedback_timeout_s": 10.0}  # a test machine may be busy
    rig: Rig = changed(small_rig(), {"experiments.reversal": quick, "guard": patient})
    return rig.model_copy(update={"period_s": PERIOD_S})


def test_a_run_on_the_clock_has_a_row_each_millisecond_late_or_not() -> None:
    samples = Samples()
    with served(rig_at_one_millisecond()) as (_, rig):
        summary = run_once(rig, samples, experiment="reversal", pacer=RealTimePacer(period_ns(PERIOD_S)))
    times_s = samples.column("time_s")
    assert times_s == [k / 1000 for k in range(len(times_s))]
    assert times_s  # as many as a busy machine allows
    timing = summary.timing
    assert timing.cycles == timing.lateness.total
    assert timing.period.total == timing.cycles - 1
    assert timing.reply_age.total + timing.unanswered == 2 * timing.cycles


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
    monkeypatch.setitem(globals(), "GAP_AFTER", gap_after)
    samples = Samples()
    with served() as (_, rig):
        run_once(rig, samples, experiment="reversal", pacer=SleepyPacer(fast(rig), gap=15))
    driven = [row for row in samples.rows if row.flags is not SLEPT_THROUGH]
    assert len(driven) < len(samples.rows)
    largest_nm = rig.guard.rate_limit_nm_per_s * rig.period_s + rig.prbs.amplitude_nm
    steps_nm = [abs(b.torque_ref_m1_nm - a.torque_ref_m1_nm) for a, b in pairwise(driven)]
    assert max(steps_nm) <= largest_nm + 1e-6
