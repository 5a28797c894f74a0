"""Changes of the driveline are found and told; what is no change is none."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import poisson

from estimator.errors import BadSetting
from estimator.identification.identify import Settings
from estimator.identification.online.adaptation import ConstantForgetting
from estimator.identification.online.chain import OnlineChain
from estimator.identification.online.online_estimate import OnlineTrajectory
from estimator.identification.tracking.watch import WatchSettings
from estimator.signals.record import Record
from tests.estimator.identification.tracking.drives import SAMPLE_TIME_S, Line, drives

TRACKING = Settings(adaptation=ConstantForgetting(0.995))
CHANGE_S = 50.0


def play(record: Record, watch: WatchSettings | None = None) -> OnlineTrajectory:
    return OnlineChain(TRACKING, SAMPLE_TIME_S, watch=watch).run(record)


@pytest.mark.parametrize("drop", [0.1, 0.2])
def test_a_stiffness_drop_is_found_and_told(drop: float) -> None:
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


def test_payload_and_rough_road_are_no_alarm() -> None:
    """A third more load moves this resonance by 0.2 %, below the smallest change."""
    lines = (Line(), Line(CHANGE_S, J_L=130.0))
    for record in drives(5, 4, 120.0, lines, road_nm=1000.0):
        assert play(record).alarms == ()


def test_a_masked_stretch_is_no_alarm() -> None:
    record = drives(6, 1, 90.0)[0]
    okay = record.okay.copy()
    okay[5000:5700] = False
    assert play(replace(record, okay=okay)).alarms == ()


def test_false_alarms_come_no_more_often_than_stated() -> None:
    """With no change tolerated and a rate high enough to be counted; beyond the bound in one of 1000 trials."""
    stated, duration_s, number = 60.0, 300.0, 6
    watch = WatchSettings(stated, smallest_change=0.0)
    came = sum(not alarm.settled for each in drives(8, number, duration_s) for alarm in play(each, watch).alarms)
    assert came <= poisson.ppf(0.999, stated * duration_s * number / 3600.0)


def test_a_statistic_is_standard_normal_where_nothing_changes() -> None:
    """Scaled by a reference of 21 blocks it is Student's with 20 degrees: variance 20/18, over all references."""
    values = []
    for record in drives(9, 6, 180.0):
        chain = OnlineChain(TRACKING, SAMPLE_TIME_S, watch=WatchSettings(smallest_change=0.0))
        kept = chain._decimator.run(chain.torque_of(record), record.output, record.okay)
        estimates = chain._estimator.run(kept.u, kept.y, kept.okay)
        found = chain._follower.run(kept.u, estimates)
        seen = chain._watch.run(np.arange(kept.u.size) * 0.02, kept.u, kept.y, estimates, found).statistic
        values.append(np.mean(np.square(seen[np.isfinite(seen)])))
    assert 0.5 < np.mean(values) < 2.0


@pytest.mark.parametrize(
    "wrong",
    [{"block_s": 0.0}, {"reference_blocks": 2}, {"settling_s": -1.0}, {"fewest_share": 0.0}, {"smallest_change": 1.0}],
)
def test_settings_that_make_no_sense_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(BadSetting, match=next(iter(wrong))):
        WatchSettings(**wrong)  # type: ignore[arg-type]
