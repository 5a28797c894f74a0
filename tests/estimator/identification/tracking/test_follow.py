"""The standard deviations given on line, against the scatter of many drives."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.identification.chain import OnlineChain
from estimator.identification.online.adaptation import ConstantForgetting
from estimator.identification.settings import Settings
from estimator.identification.tracking.follow import SAMPLES_BEFORE_STD
from tests.estimator.identification.tracking.drives import SAMPLE_TIME_S, Line, drives

RUNS = 24


@pytest.mark.parametrize(
    ("settings", "conditions"),
    [
        (Settings(), {"noise_rad_s": 1.0, "road_nm": 0.0}),
        (Settings(adaptation=ConstantForgetting(0.995)), {"road_nm": 1000.0}),
    ],
)
def test_intervals_hold_the_truth(settings: Settings, conditions: dict[str, float]) -> None:
    """Of 24 intervals of 95 % each, fewer than 20 hold the truth in one of 50 trials; the deviations are not idle."""
    truth = np.array(Line().resonance)
    z = []
    for record in drives(11, RUNS, 22.0, **conditions):
        last = OnlineChain(settings, SAMPLE_TIME_S).run(record)[-1]
        assert last.resonance is not None
        found = np.array([last.resonance.frequency_hz, last.resonance.damping])
        z.append((found - truth) / np.array([last.frequency_std_hz, last.damping_std]))
    held = (np.abs(z) < 1.96).sum(axis=0)
    assert held.min() >= 20
    assert np.sqrt(np.mean(np.square(z), axis=0)).min() > 0.3


def test_nothing_is_claimed_before_the_first_samples() -> None:
    course = OnlineChain(Settings(), SAMPLE_TIME_S).run(drives(1, 1, 12.0)[0])
    known = np.flatnonzero(np.isfinite(course.frequency_std_hz))
    assert known[0] >= SAMPLES_BEFORE_STD
    assert np.isfinite(course.frequency_hz[known]).all()
    assert (course.frequency_std_hz[known] > 0).all()


def test_a_masked_stretch_makes_nothing_surer() -> None:
    record = drives(2, 1, 30.0)[0]
    okay = record.okay.copy()
    okay[1500:] = False
    course = OnlineChain(Settings(), SAMPLE_TIME_S).run(replace(record, okay=okay))
    blind = course.frequency_std_hz[760:]
    assert blind == pytest.approx(course.frequency_std_hz[749], rel=1e-9)
