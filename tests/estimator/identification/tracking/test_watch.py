"""Changes of the driveline are found and reported; what is no change is none."""

import json
from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import chi, norm, poisson

from estimator.errors import BadSetting
from estimator.identification.chain import OnlineChain, OnlineTrajectory
from estimator.identification.online.adaptation import ConstantForgetting
from estimator.identification.settings import Settings
from estimator.identification.tracking.alarm import TrackingState, false_pairs, threshold_for
from estimator.identification.tracking.watch import Baseline, ChangeWatch, Spread, WatchSettings, spread_of
from estimator.signals.record import Record
from tests.estimator.identification.tracking.drives import PRBS_NM, SAMPLE_TIME_S, Line, drives

TRACKING = Settings(adaptation=ConstantForgetting(0.995))
CHANGE_S = 50.0


def play(record: Record, watch: WatchSettings | None = None) -> OnlineTrajectory:
    return OnlineChain(TRACKING, SAMPLE_TIME_S, watch=watch).run(record)


@pytest.mark.parametrize("drop", [0.1, pytest.param(0.2, marks=pytest.mark.campaign)])
def test_a_stiffness_drop_is_found_and_reported(drop: float) -> None:
    before, after = Line(), Line(CHANGE_S, k=4200.0 * (1.0 - drop))
    for record in drives(4, 4, 80.0, (before, after)):
        first, settled = play(record).alarms
        assert CHANGE_S < first.time_s < CHANGE_S + 8.0
        assert first.changed_between_s[0] <= CHANGE_S <= first.changed_between_s[1]
        assert not first.settled
        assert settled.settled
        assert settled.time_s == first.time_s
        assert settled.before.value == pytest.approx(before.resonance[0], rel=0.01)
        assert settled.after.value == pytest.approx(after.resonance[0], rel=0.01)
        assert settled.after.ci95[0] < after.resonance[0] < settled.after.ci95[1]
        assert abs(settled.statistic) > settled.threshold
        assert json.loads(json.dumps(settled.as_json()))["evidence"]["false_alarms_per_hour"] == 0.1
        assert f"{settled.time_s:.1f} s" in settled.statement


@pytest.mark.campaign
@pytest.mark.parametrize(
    "share_in_10_s", [0.01, -0.03, *(pytest.param(share, marks=pytest.mark.campaign) for share in (-0.01, 0.03))]
)
def test_a_drift_that_continues_is_alarmed_again(share_in_10_s: float) -> None:
    """Of the stiffness; half of it of the resonance. Nothing larger than 4 % of it goes by without an alarm."""
    begin_s, end_s = 40.0, 200.0
    moments = np.arange(0.0, end_s, 1.0).tolist()
    lines = [Line(t, k=4200.0 * (1.0 + share_in_10_s) ** (max(t - begin_s, 0.0) / 10.0)) for t in moments]
    for record in drives(12, 4, end_s, lines):
        alarms = play(record).alarms
        found = [alarm for alarm in alarms if not alarm.settled]
        assert found[0].time_s > begin_s
        settled = [alarm.after.value for alarm in alarms if alarm.settled]
        assert (np.sign(np.diff([Line().resonance[0], *settled])) == np.sign(share_in_10_s)).all()
        reported = [begin_s, *(alarm.time_s for alarm in found), end_s]
        moved = np.diff(np.sqrt([lines[int(t) - 1].k for t in reported])) / np.sqrt(4200.0)
        assert len(found) >= 2
        assert np.abs(moved).max() < 0.04 if abs(share_in_10_s) < 0.02 else np.abs(moved).max() < 0.09


def test_payload_and_rough_road_are_no_alarm() -> None:
    """A third more load moves this resonance by 0.2 %, below the smallest change."""
    lines = (Line(), Line(CHANGE_S, J_L=130.0))
    for record in drives(5, 4, 120.0, lines, road_nm=1000.0):
        assert play(record).alarms == ()


@pytest.mark.campaign
@pytest.mark.parametrize(
    "prbs_nm",
    [
        lambda time_s: PRBS_NM,
        pytest.param(lambda time_s: 0.25 * PRBS_NM, marks=pytest.mark.campaign),
        lambda time_s: PRBS_NM if time_s % 60.0 < 30.0 else 0.0,
        pytest.param(lambda time_s: PRBS_NM if time_s % 60.0 < 30.0 else 0.25 * PRBS_NM, marks=pytest.mark.campaign),
    ],
    ids=["on", "weak", "on and off", "strong and weak"],
)
def test_false_alarms_come_no_more_often_than_stated(prbs_nm: Callable[[float], float]) -> None:
    """With no change tolerated and a rate high enough to be counted; beyond the bound in one of 1000 trials."""
    stated, duration_s, number = 60.0, 300.0, 6
    watch = WatchSettings(stated, smallest_change=0.0)
    courses = [play(each, watch) for each in drives(8, number, duration_s, prbs_nm=prbs_nm)]
    watched_s = sum(float((course.state == TrackingState.WATCHING).sum()) * 0.02 for course in courses)
    assert watched_s > 0.3 * duration_s * number
    got = sum(not alarm.settled for course in courses for alarm in course.alarms)
    assert got <= poisson.ppf(0.999, stated * watched_s / 3600.0)


def test_a_statistic_is_standard_normal_where_nothing_changes() -> None:
    """Scaled by a reference of 21 blocks it is Student's with 19 degrees: variance 19/17, over all references."""
    values = []
    for record in drives(9, 6, 180.0):
        chain = OnlineChain(TRACKING, SAMPLE_TIME_S, watch=WatchSettings(smallest_change=0.0))
        seen = [watch.statistic for watch in watched_blocks(chain, record)]
        values.append(np.nanmean(np.square(seen)))
    assert 0.5 < np.mean(values) < 2.0


def watched_blocks(chain: OnlineChain, record: Record) -> Iterator[ChangeWatch]:
    """Give the watch after each block of a drive."""
    torque_nm = chain.torque_of(record)
    for part in (slice(first, first + 100) for first in range(0, record.time_s.size, 100)):
        chain.run_block(record.time_s[part], torque_nm[part], record.output[part], record.okay[part])
        yield chain._tracker.watch


def test_a_reference_that_explains_nothing_is_given_up() -> None:
    chain, seen = OnlineChain(TRACKING, SAMPLE_TIME_S), []
    for watch in watched_blocks(chain, drives(13, 1, 80.0)[0]):
        seen.append(watch.doing)
        if seen[-2:] == [TrackingState.STARTING, TrackingState.LEARNING] and seen.count(TrackingState.LEARNING) == 1:
            watch._live["theta"][4:] *= -1.0
    changes = [state for before, state in pairwise(seen) if state is not before]
    assert changes == [TrackingState.LEARNING, TrackingState.STARTING, TrackingState.LEARNING, TrackingState.WATCHING]


@pytest.mark.parametrize(
    "wrong",
    [
        {"block_s": 0.0},
        {"reference_blocks": 2},
        {"baseline_blocks": 0},
        {"settling_s": -1.0},
        {"fewest_share": 0.0},
        {"smallest_change": 1.0},
    ],
)
def test_settings_that_make_no_sense_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(BadSetting, match=next(iter(wrong))):
        WatchSettings(**wrong)  # type: ignore[arg-type]


NUMBER = np.arange(2.0, 23.0)


@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_a_drift_is_no_spread(slope: float) -> None:
    rng = np.random.default_rng(3)
    spreads = [spread_of(NUMBER, slope * NUMBER + rng.normal(0.0, 0.5, 21), np.full(21, 4.0)) for _ in range(400)]
    assert np.sqrt(np.mean([spread.of_x**2 for spread in spreads])) == pytest.approx(1.0, rel=0.05)
    assert spreads[0].usual == 4.0


@pytest.mark.parametrize(("information", "std_hz"), [(1.0, 1.0), (0.25, 2.0), (16.0, 1.0)])
def test_neither_a_weaker_nor_a_stronger_excitation_is_judged_too_sharply(information: float, std_hz: float) -> None:
    """Noise spreads the weaker one's frequencies more; what the model lacks spreads the stronger one's no less."""
    statistic = Baseline(0.0, 1e12).statistic(3.0, information, 0.5, Spread(1.0, 1.0))
    assert statistic == pytest.approx(2.5 / std_hz)


@pytest.mark.parametrize(("threshold", "n"), [(1.5, 21), (2.0, 10)])
def test_probability_is_that_of_a_trial(threshold: float, n: int) -> None:
    x = np.random.default_rng(5).normal(3.0, 2.0, (200_000, n + 2))
    mean, std = x[:, :n].mean(axis=1, keepdims=True), x[:, :n].std(axis=1, ddof=1, keepdims=True)
    tau = (x[:, n:] - mean) / (std * np.sqrt(1 + 1 / n))
    pairs = (tau > threshold).all(axis=1) | (tau < -threshold).all(axis=1)
    scatter = np.sqrt(pairs.mean() / pairs.size)
    assert false_pairs(threshold, n, n - 1) == pytest.approx(pairs.mean(), abs=4 * scatter)


@pytest.mark.campaign
@pytest.mark.parametrize(("threshold", "n", "freedom"), [(0.0, 21, 20), (0.5, 21, 20), (2.5, 7, 19), (5.0, 3, 1)])
def test_probability_is_that_of_the_normal_tail_over_mean_and_spread(threshold: float, n: int, freedom: int) -> None:
    """The rule as it is stated: ``2 E[Q(h s sqrt(1 + 1/n) + m)^2]`` with m normal and nu s^2 chi-squared."""

    def given_mean(spread: float) -> float:
        beyond = threshold * spread * np.sqrt(1 + 1 / n)
        return float(norm.expect(lambda m: norm.sf(beyond + m) ** 2, scale=n**-0.5))

    expected = quad(lambda s: given_mean(s) * chi.pdf(s, freedom, scale=freedom**-0.5), 0.0, 8.0, epsabs=1e-9)[0]
    assert false_pairs(threshold, n, freedom) == pytest.approx(2 * expected, rel=1e-4)


def test_threshold_gives_the_rate_it_was_asked_for() -> None:
    threshold = threshold_for(0.1, 3600.0, 21, 20)
    assert 3600.0 * false_pairs(threshold, 21, 20) == pytest.approx(0.1, rel=1e-3)
    assert threshold_for(0.01, 3600.0, 21, 20) > threshold > threshold_for(0.1, 3600.0, 100, 99)


@pytest.mark.parametrize("rate", [0.0, -1.0, 3600.0, float("nan")])
def test_a_rate_no_threshold_has_is_refused(rate: float) -> None:
    with pytest.raises(BadSetting, match="false_alarms_per_hour"):
        threshold_for(rate, 3600.0, 21, 20)
