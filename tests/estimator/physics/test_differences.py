"""Derivatives by differences, beside the same written with numpy."""

from __future__ import annotations

import numpy as np
import pytest

from estimator.physics.differences import differences

STEPS = np.array([1e-5, -1e-5])


@pytest.fixture
def output() -> np.ndarray:
    return np.random.default_rng(1).standard_normal(50)


def test_samples_that_count_are_told_per_step(output: np.ndarray) -> None:
    moved = output + STEPS[:, np.newaxis] * np.random.default_rng(2).standard_normal((2, 50))
    use = np.arange(50) % 3 > 0
    np.testing.assert_array_equal(
        differences(moved, output, use, STEPS, 1e3, 0.0), ((moved - output) / STEPS[:, np.newaxis])[:, use]
    )


@pytest.mark.parametrize(("ran_to", "stays_at"), [(np.nan, 7.0), (np.inf, 7.0), (-np.inf, -7.0), (9.0, 7.0)])
def test_what_has_run_away_stays_far_away(output: np.ndarray, ran_to: float, stays_at: float) -> None:
    moved = np.stack([output, output])
    moved[1, 20:] = ran_to
    found = differences(moved, output, np.ones(50, dtype=bool), STEPS, 7.0, 0.0)
    np.testing.assert_array_equal(found[0], 0.0)
    np.testing.assert_array_equal(found[1, 20:], (stays_at - output[20:]) / STEPS[1])


def test_a_change_by_rounding_alone_is_none(output: np.ndarray) -> None:
    moved = np.stack([output, output])
    moved[0, 3] += 1e-9
    moved[1, 3] += 3e-9
    found = differences(moved, output, np.ones(50, dtype=bool), STEPS, 1e3, 2e-9)
    np.testing.assert_array_equal(found[0], 0.0)
    assert found[1, 3] == pytest.approx(3e-9 / STEPS[1], rel=1e-5)
