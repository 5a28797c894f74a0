"""Derivatives by differences, next to the same written with numpy."""

from __future__ import annotations

import numpy as np
import pytest

from estimator.physics.jacobian import fill_differences

STEPS = np.array([1e-5, -1e-5])


@pytest.fixture
def output() -> np.ndarray:
    return np.random.default_rng(1).standard_normal(50)


def of_one_recording(
    moved: np.ndarray, output: np.ndarray, use: np.ndarray, limit: float = 1e3, least: float = 0.0
) -> np.ndarray:
    """Return the derivatives by two unknowns of the samples that count, a row each."""
    found = np.zeros((2, int(use.sum())))
    both, one = np.arange(2), np.zeros((2, 1), dtype=int)
    limits, leasts, begins = np.array([limit]), np.array([least]), np.array([0, use.sum()])
    fill_differences(
        moved[:, np.newaxis], one, output[np.newaxis], use[np.newaxis], STEPS, limits, leasts, both, begins, found
    )
    return found


def test_samples_that_count_are_reported_per_step(output: np.ndarray) -> None:
    moved = output + STEPS[:, np.newaxis] * np.random.default_rng(2).standard_normal((2, 50))
    use = np.arange(50) % 3 > 0
    np.testing.assert_array_equal(
        of_one_recording(moved, output, use), ((moved - output) / STEPS[:, np.newaxis])[:, use]
    )


@pytest.mark.parametrize(("ran_to", "stays_at"), [(np.nan, 7.0), (np.inf, 7.0), (-np.inf, -7.0), (9.0, 7.0)])
def test_what_has_run_away_stays_far_away(output: np.ndarray, ran_to: float, stays_at: float) -> None:
    moved = np.stack([output, output])
    moved[1, 20:] = ran_to
    found = of_one_recording(moved, output, np.ones(50, dtype=bool), limit=7.0)
    np.testing.assert_array_equal(found[0], 0.0)
    np.testing.assert_array_equal(found[1, 20:], (stays_at - output[20:]) / STEPS[1])


def test_a_change_by_rounding_alone_is_none(output: np.ndarray) -> None:
    moved = np.stack([output, output])
    moved[0, 3] += 1e-9
    moved[1, 3] += 3e-9
    found = of_one_recording(moved, output, np.ones(50, dtype=bool), least=2e-9)
    np.testing.assert_array_equal(found[0], 0.0)
    assert found[1, 3] == pytest.approx(3e-9 / STEPS[1], rel=1e-5)


def test_each_recording_has_its_own_samples_limit_and_place(output: np.ndarray) -> None:
    """The second is shorter: behind its end nothing counts, whatever stands there."""
    outputs = np.stack([output, output[::-1]])
    use = np.stack([np.arange(50) > 1, np.arange(50) < 20])
    moved = np.full((2, 50), 5e-5) + outputs[::-1]
    moved[0, 20:] = np.nan
    found = np.zeros((3, 68))
    of, columns = np.array([[1], [0]]), np.array([2, 0])
    limits, least = np.array([1e3, 0.5]), np.zeros(2)
    fill_differences(
        moved[:, np.newaxis], of, outputs, use, STEPS, limits, least, columns, np.array([0, 48, 68]), found
    )
    np.testing.assert_array_equal(found[0, :48], (moved[1] - output)[2:] / STEPS[1])
    np.testing.assert_array_equal(found[2, 48:], (np.clip(moved[0], -0.5, 0.5) - output[::-1])[:20] / STEPS[0])
    assert not found[1].any()
    assert not found[0, 48:].any()
    assert not found[2, :48].any()
