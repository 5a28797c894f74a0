"""What a recording says of the motion: speed from position, sizes, changes of sign."""

import numpy as np
import pytest

from estimator.physics.motion import (
    measured_speed,
    reverses,
    speed_by_place,
    torque_reverses,
)
from estimator.signals.record import OutputKind
from tests.estimator.physics.bench import record

TIME_S = np.arange(500) * 0.01


@pytest.mark.parametrize("sample_time_s", [0.01, 0.001, 0.05])
def test_the_speed_of_a_parabola_is_exact_inside(sample_time_s: float) -> None:
    """A central difference is exact for a parabola, whatever its width."""
    time_s = np.arange(500) * sample_time_s
    rec = record(np.ones(500), 3.0 * time_s**2, kind=OutputKind.POSITION, sample_time_s=sample_time_s)
    speed = measured_speed(rec)
    inside = np.isfinite(speed)
    half = max(1, round(0.01 / sample_time_s))
    assert inside.sum() == 500 - 2 * half
    np.testing.assert_allclose(speed[inside], 6.0 * time_s[inside], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [(-5.0, 5.0, True), (0.0, 5.0, False), (-5.0, -0.1, False), (-0.04, 5.0, False), (-1.0, 5.0, True)],
)
def test_a_reversal_must_be_clear(low: float, high: float, expected: bool) -> None:
    assert reverses(record(np.ones(500), np.linspace(low, high, 500))) is expected


@pytest.mark.parametrize(("creep", "expected"), [(-0.04, False), (-0.06, True)])
def test_a_backward_creep_below_a_hundredth_of_the_speed_is_no_reversal(creep: float, expected: bool) -> None:
    speed = np.full(500, 5.0)
    speed[:50] = creep
    assert reverses(record(np.ones(500), speed)) is expected


@pytest.mark.parametrize(("low", "expected"), [(-100.0, True), (-9.0, False), (0.0, False), (-20.0, True)])
def test_a_torque_reversal_must_be_a_tenth_of_the_torque(low: float, expected: bool) -> None:
    assert torque_reverses(record(np.linspace(low, 100.0, 500))) is expected


def test_a_swing_that_repeats_passes_each_place_at_one_speed() -> None:
    swing = np.cos(2.0 * np.pi * TIME_S)
    assert speed_by_place(record(np.ones(500), swing, kind=OutputKind.POSITION)) > 0.9


def test_swings_of_different_speed_and_a_motion_that_continues_do_not() -> None:
    time_s = np.arange(1000) * 0.01
    phase = np.where(time_s < 5.0, 0.5 * time_s, 2.5 + 2.0 * (time_s - 5.0))
    slow_then_fast = np.abs(np.mod(phase, 1.0) - 0.5)  # to and fro, each time at one speed
    assert speed_by_place(record(np.ones(1000), slow_then_fast, kind=OutputKind.POSITION)) < 0.5
    assert speed_by_place(record(np.ones(500), TIME_S + np.sin(TIME_S), kind=OutputKind.POSITION)) == 0.0
