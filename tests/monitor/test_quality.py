"""Quality of the samples: what is counted, since when, in what words."""

import math

import pytest

from hil.monitor.snapshot import NO_VALUE, STANDS_STILL_S, Quality, QualityWatch
from hil.sample import SampleFlag
from tests.monitor.fake_source import PERIOD_S, sample

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
