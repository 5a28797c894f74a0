"""Work and memory follow from the data: what they can't carry is refused, or left out, before room is made for it."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from estimator.diagnosis.preconditions.room import require_room
from estimator.diagnosis.unnamed.orders import LONGEST_TRAVEL, peaks
from estimator.errors import BadSetting, BadShape
from estimator.identification.identify import identify
from estimator.signals.decimate import MOST_FACTOR, Decimator
from estimator.signals.record import Record

N = 3000
RNG = np.random.default_rng(1)


def record(sample_time_s: float) -> Record:
    okay = np.ones(N, dtype=bool)
    return Record(
        "fast", sample_time_s, sample_time_s * np.arange(N), RNG.normal(size=(N, 1)), RNG.normal(size=N), okay
    )


@pytest.mark.parametrize("sample_time_s", [1e-9, 1e-7])
def test_samples_far_too_fast_for_the_models_are_refused_without_a_filter_for_them(sample_time_s: float) -> None:
    tracemalloc.start()
    with pytest.raises(BadSetting, match=f"factor .* expected 1 to {MOST_FACTOR}; is time in s"):
        identify(record(sample_time_s))
    assert tracemalloc.get_traced_memory()[1] < 1 << 24
    tracemalloc.stop()
    assert Decimator(0.02 / MOST_FACTOR, MOST_FACTOR).delay_samples > 0


def test_more_recordings_than_a_fit_can_hold_are_refused() -> None:
    """Fifty of 3000 rows took 7 GiB: each has unknowns of its own, and a fit every sample for every unknown."""
    require_room([record(0.01)] * 30)
    with pytest.raises(BadShape, match=r"50 recordings .* of 150000 samples in all: expected at most"):
        require_room([record(0.01)] * 50)


@pytest.mark.parametrize("travel_rad", [1e6, 1e9, 1e12])
def test_an_angle_in_a_wrong_unit_makes_no_grid_as_long_as_it(travel_rad: float) -> None:
    angle = np.linspace(0.0, travel_rad, N)
    tracemalloc.start()
    assert peaks([RNG.normal(size=N)], [angle]).size == 0
    assert tracemalloc.get_traced_memory()[1] < 1 << 26
    tracemalloc.stop()


def test_the_order_of_a_long_drive_is_found_in_its_pieces() -> None:
    angle = np.linspace(0.0, 4.0 * LONGEST_TRAVEL, 400_000)
    found = peaks([np.sin(7.0 * angle) + RNG.normal(size=angle.size)], [angle])
    assert found[0] == pytest.approx(7.0, abs=0.01)
