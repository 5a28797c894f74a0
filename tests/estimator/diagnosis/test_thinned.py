"""A recording faster than the line needs is thinned, and says the same of the line."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.inference.hypotheses import NOTHING, all_good_samples
from estimator.diagnosis.segments import as_slow_as_needed, factor_for, thinned
from estimator.diagnosis.thresholds import Noise, Recordings
from estimator.physics.driveline import InitialCondition
from estimator.physics.layout import flat, grid_for
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.physics.simulate import simulate
from estimator.signals.record import OutputKind
from tests.estimator.diagnosis.plain import Bench
from tests.estimator.physics.bench import TWO_MASS, model, random_steps, record

LINE = model(TWO_MASS)


@pytest.mark.parametrize(("period_s", "factor"), [(0.01, 1), (0.02, 1), (0.005, 2)])
def test_one_in_as_many_samples_as_the_line_allows(period_s: float, factor: int) -> None:
    """The line swings at a few hertz: 10 ms are enough, and the most."""
    torque = random_steps(500, 1)
    read = replace(record(torque, np.zeros(500)), sample_time_s=period_s)
    assert factor_for([read], LINE) == factor
    assert factor * period_s <= max(Recordings.LONGEST_S, period_s)


def test_a_stiff_line_keeps_twelve_samples_a_period() -> None:
    stiff = model({**TWO_MASS, "k": 100.0 * TWO_MASS["k"]})
    j = TWO_MASS["J_M"] * TWO_MASS["J_L"] / (TWO_MASS["J_M"] + TWO_MASS["J_L"])
    period_s = 2.0 * np.pi / np.sqrt(100.0 * TWO_MASS["k"] / j)
    torque = random_steps(500, 1)
    factor = factor_for([replace(record(torque, np.zeros(500)), sample_time_s=0.0001)], stiff)
    assert period_s / (factor * 0.0001) >= 12.0
    assert period_s / ((factor + 1) * 0.0001) < 12.0


def test_a_joint_keeps_twelve_samples_a_period_of_what_it_takes() -> None:
    """Force of a slow sine and a little ringing: the ringing has less than a hundredth of the power."""
    time_s = 0.001 * np.arange(8000)
    motion = np.sin(2.0 * np.pi * time_s)
    force = motion + 0.1 * np.sin(2.0 * np.pi * 50.0 * time_s)
    fast = replace(record(force, force), sample_time_s=0.001, time_s=time_s, imposed=motion, kind=OutputKind.FORCE)
    joint = DrivelineModel(Structure.JOINT, {"k": Parameter(1.0, 0.5), "c": Parameter(1.0, 0.5)})
    (thin,) = as_slow_as_needed([fast], joint)
    assert thin.sample_time_s == pytest.approx(Recordings.LONGEST_OF_RIGID_S)
    assert thin.imposed is not None
    np.testing.assert_array_equal(thin.imposed, motion[:: round(Recordings.LONGEST_OF_RIGID_S / 0.001)])
    ringing = replace(fast, output=motion + 0.3 * np.sin(2.0 * np.pi * 50.0 * time_s))
    (thin,) = as_slow_as_needed([ringing], joint)
    assert 1.0 / (12.0 * 50.0) >= thin.sample_time_s > 0.5 / (12.0 * 50.0)


def test_the_line_found_is_the_same() -> None:
    """Torque that changes every 10 ms, read every millisecond, more often than is used."""
    torque = np.repeat(random_steps(Noise.MOST_SAMPLES // 10 + 1, 1, mean_nm=20.0), 10)
    time_s = 0.001 * np.arange(torque.size)
    blank = replace(record(torque, np.zeros(torque.size)), sample_time_s=0.001, time_s=time_s)
    clean = simulate(grid_for(LINE, [blank]), blank, flat(LINE), InitialCondition(5.0, 0.0, 5.0, 0.001, 5.0))
    fast = replace(blank, output=clean + 0.02 * np.random.default_rng(1).standard_normal(torque.size))
    (thin,) = thinned([fast], LINE)
    assert thin.sample_time_s == pytest.approx(0.01)
    assert thin.output.size == fast.output.size // 10
    short = replace(fast, **{name: getattr(fast, name)[:9000] for name in ("time_s", "torque_nm", "output", "okay")})
    assert thinned([short], LINE) == [short]
    found = Bench(LINE, [thin], all_good_samples([thin])).fit(NOTHING)
    assert found.rms == pytest.approx(0.02, rel=0.05)
    assert found.value("", "k") == pytest.approx(TWO_MASS["k"], rel=0.01)
