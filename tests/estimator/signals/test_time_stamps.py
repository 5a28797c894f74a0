"""The period behind stamps: as set, whatever the stamps' rounding and jitter."""

from __future__ import annotations

import numpy as np
import pytest

from estimator.signals.record import uniform_period_s


@pytest.mark.parametrize("period_s", [0.01, 0.002, 0.0125, 0.1, 1.0 / 1024.0])
@pytest.mark.parametrize("start_s", [0.0, 1234.56])
def test_even_stamps_give_their_step(period_s: float, start_s: float) -> None:
    assert uniform_period_s(start_s + period_s * np.arange(3000)) == pytest.approx(period_s, rel=1e-8)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("jitter_s", [1e-4, 1e-3, 3e-3])
def test_jitter_does_not_spoil_it(seed: int, jitter_s: float) -> None:
    jitter = jitter_s * np.random.default_rng(seed).standard_normal(3000)
    assert uniform_period_s(0.01 * np.arange(3000) + jitter) == 0.01


def test_rounding_does_not_spoil_it() -> None:
    period_s = 1.0 / 120.0
    assert uniform_period_s(np.round(period_s * np.arange(3000), 3)) == pytest.approx(period_s, rel=1e-6)


def test_a_period_that_is_not_round_is_kept() -> None:
    """A clock 20 ppm fast, with a jitter that determines the period to 1 ppm."""
    jitter = 1e-4 * np.random.default_rng(1).standard_normal(30_000)
    assert uniform_period_s(0.0100002 * np.arange(30_000) + jitter) == pytest.approx(0.0100002, rel=1e-6)


def test_two_stamps_give_their_difference() -> None:
    assert uniform_period_s(np.array([1.0, 1.25])) == 0.25
