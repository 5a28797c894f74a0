"""How far a torque that stands in for one that was not read may be from it."""

from __future__ import annotations

import numpy as np
import pytest

from estimator.signals.correlation import stand_in_variance
from estimator.signals.record import Record

COUNT = 20_000


def record(torque: np.ndarray, unread: slice) -> Record:
    trusted = np.ones(torque.shape, dtype=bool)
    trusted[unread, 0] = False
    time_s = 0.01 * np.arange(COUNT)
    return Record("run", 0.01, time_s, torque, time_s, np.ones(COUNT, dtype=bool), torque_okay=trusted)


@pytest.mark.parametrize("gap", [1, 3, 8])
def test_the_variance_is_that_of_a_line_drawn_over_the_gap(gap: int) -> None:
    """A random walk is a Brownian bridge between its ends: its variance in the middle is a quarter of the length."""
    walk = np.cumsum(np.random.default_rng(gap).standard_normal(COUNT))
    found = stand_in_variance(record(np.column_stack([walk, walk]), slice(50, 50 + gap)))
    half = (gap + 2) // 2
    bridge = half * (gap + 1 - half) / (gap + 1)
    np.testing.assert_allclose(found[50 : 50 + gap], bridge, rtol=0.1)
    assert np.count_nonzero(found) == gap


def test_where_everything_was_read_there_is_none() -> None:
    assert not stand_in_variance(record(np.ones((COUNT, 1)), slice(0, 0))).any()


def test_a_gap_as_long_as_the_recording_is_bounded_by_it() -> None:
    found = stand_in_variance(record(np.linspace(0.0, 1.0, COUNT)[:, np.newaxis], slice(0, COUNT)))
    assert np.isfinite(found).all()
