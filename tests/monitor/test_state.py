"""What the view knows after what it was sent."""

import math

import numpy as np
import pytest

from estimator.physics.joint import Shaft
from hil.monitor.messages import Began, LogTopic, Lost, Notice, Over, Ready, Samples
from hil.monitor.snapshot import NO_VALUE, STANDS_STILL_S, Activity, Quality, QualityWatch
from hil.monitor.state import LiveState
from hil.rig.experiments.base import Phase
from hil.sample import SampleFlag
from hil.simulator.driveline import DEFAULT_BUS
from tests.monitor.fake_source import PERIOD_S, sample

DONE = Over("cruise", "runs/cruise.parquet", 3000, 2, stopped=False, reason=None, run_id=7)


def state(can_drive: bool = True) -> LiveState:
    return LiveState("bus", PERIOD_S, Shaft.of_model(DEFAULT_BUS, "model"), can_drive)


def test_a_run_from_order_to_end() -> None:
    live = state()
    live.take(Ready())
    assert live.activity is Activity.LISTENING
    live.starting("cruise")
    assert live.is_driving
    live.take(Began("cruise", "runs/cruise.parquet", 30.0))
    live.take(Samples(((sample(150, 20.0, 3.0), Phase.MEASURE),)))
    head = live.snapshot().headline
    assert (head.activity, head.phase, head.phase_s, head.duration_s) == (Activity.RUNNING, "measure", 1.5, 30.0)
    live.stopping("stop")
    assert live.activity is Activity.STOPPING
    live.take(DONE)
    assert live.activity is Activity.LISTENING
    assert live.runs == [DONE]
    assert "3000 samples, 2 flagged, run 7, runs/cruise.parquet" in live.snapshot().headline.message


def test_what_was_refused_while_connecting_is_no_news_once_the_rig_is_there() -> None:
    live = state()
    live.say("only a rig that is listened to can be started")
    live.take(Ready())
    assert live.snapshot().headline.message == ""
    live.take(DONE)
    live.take(Ready())
    assert "3000 samples" in live.snapshot().headline.message


def test_a_flagged_sample_is_a_gap_and_not_a_value() -> None:
    live = state()
    rows = ((sample(0, 10.0, 1.0), None), (sample(1, 999.0, 9.0, flags=SampleFlag.M1_STALE), None))
    live.take(Samples(rows))
    signals = live.snapshot().signals
    np.testing.assert_array_equal(signals.torque_nm, [10.0, math.nan])
    np.testing.assert_array_equal(signals.speed_rad_s, [1.0, math.nan])
    np.testing.assert_allclose(signals.time_s, [-PERIOD_S, 0.0], atol=1e-12)


def test_a_lost_bus_is_reported_once_and_its_return_too() -> None:
    live = state()
    for report in (Ready(), Lost("no bus"), Lost("no bus"), Ready()):
        live.take(report)
    assert [notice.text for notice in live.snapshot().log] == ["no bus", "the bus is there again"]
    assert live.activity is Activity.LISTENING


def test_the_log_says_how_long_ago_what_happened_without_samples() -> None:
    live, up_for = state(), 360_000_000  # this machine has run for 1,000 h at 10 ms a number
    live.take(Lost("no bus"))
    live.take(Samples(((sample(up_for), None),)))
    shown = live.snapshot()
    assert [(shown.now_ns - each.t_ns) / 1e9 for each in shown.log] == [0.0]
    live.snapshot(silent_s=20.0)
    live.take(Lost("no bus"))
    live.take(Ready())
    shown = live.snapshot(silent_s=25.0)
    assert [(shown.now_ns - each.t_ns) / 1e9 for each in shown.log] == [25.0, 5.0]


@pytest.mark.parametrize("kind", [kind for kind in LogTopic if kind is not LogTopic.INFO])
def test_what_matters_stands_in_the_message_with_its_kind(kind: LogTopic) -> None:
    live = state()
    live.take(Notice(0, kind, "text"))
    assert live.snapshot().headline.message == f"{kind.value}: text"


def test_a_recording_is_played_and_not_driven() -> None:
    live = state(can_drive=False)
    live.take(Began("", "cruise.csv", 30.0))
    live.take(Samples(((sample(100), Phase.MEASURE),)))
    head = live.snapshot().headline
    assert (head.activity, head.phase_s) == (Activity.REPLAYING, 1.0)
    assert not live.is_driving
    live.take(Over("", "cruise.csv", 3000, 0, stopped=False, reason=None))
    assert live.activity is Activity.PLAYED


GOOD, M1, M2, LATE = SampleFlag.GOOD, SampleFlag.M1_STALE, SampleFlag.M2_STALE, SampleFlag.LATE


def seen(*flags: SampleFlag) -> Quality:
    """Quality after samples with these flags, at the time of the last."""
    watch = QualityWatch(PERIOD_S)
    for cycle, flag in enumerate(flags):
        watch.take(sample(cycle, flags=flag))
    return watch.look(sample(len(flags) - 1).t_ns)


def test_reasons_are_counted_the_most_frequent_first() -> None:
    quality = seen(GOOD, LATE, M1, M1 | M2, GOOD)
    assert (quality.samples, quality.good) == (5, 2)
    assert quality.reasons == "m1 silent 2x, m2 silent 1x, cycle late 1x"
    assert quality.bad_share == pytest.approx(0.6)


def test_a_limit_of_the_drive_is_counted_and_takes_nothing_from_the_sample() -> None:
    quality = seen(GOOD, SampleFlag.M1_LIMITED, SampleFlag.M1_LIMITED | M2)
    assert (quality.samples, quality.good) == (3, 2)
    assert quality.reasons == "m1 in its internal limit 2x, m2 silent 1x"
    assert seen(GOOD, SampleFlag.M2_LIMITED).standing_s == 0.0


def test_the_time_without_a_good_sample_counts_until_the_next() -> None:
    n = round(STANDS_STILL_S / PERIOD_S)
    short, long = seen(GOOD, *[M1] * (n - 1)), seen(GOOD, *[M1] * n)
    assert not short.stands_still
    assert long.stands_still
    assert long.standing_s == pytest.approx(STANDS_STILL_S)
    assert long.why == "m1 silent"
    assert seen(GOOD, *[M1] * n, GOOD).standing_s == 0.0


def test_a_number_that_is_missing_without_a_flag_counts_too() -> None:
    watch = QualityWatch(PERIOD_S)
    assert watch.take(sample(0)) == 0
    assert watch.take(sample(1, speed_rad_s=math.nan)) == NO_VALUE
    assert watch.look(sample(1).t_ns).reasons == "no value 1x"
