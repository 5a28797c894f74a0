"""The cycle at 1 ms: the same logic, on the wall clock and without it. No time is judged."""

from hil.config.rig_file import Rig
from hil.rig.pacing import RealTimePacer, period_ns
from tests.rig.serving import Samples, changed, run_once, served, small_rig

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
    assert len(times_s) >= 200 - 1
    timing = summary.timing
    assert timing.cycles == timing.lateness.total
    assert timing.period.total == timing.cycles - 1
    assert timing.reply_age.total + timing.unanswered == 2 * timing.cycles
