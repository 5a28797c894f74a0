"""Work and memory follow from the data: what they can't carry is refused, or left out, before room is made for it."""

from __future__ import annotations

import math
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.preconditions.thinned import MOST, with_room
from estimator.diagnosis.segments import cut
from estimator.diagnosis.unnamed.orders import LONGEST_TRAVEL, peaks
from estimator.errors import BadSetting
from estimator.identification.identify import identify
from estimator.signals.decimate import MOST_FACTOR, Decimator
from estimator.signals.part import sliced
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


def named(count: int, samples: int = N) -> list[Record]:
    whole = record(0.01)
    return [replace(sliced(whole, slice(0, samples)), name=f"run_{i}") for i in range(count)]


@pytest.mark.parametrize(("count", "samples"), [(50, N), (13, N), (200, 300), (800, 100)])
def test_of_more_recordings_than_a_fit_can_hold_some_of_every_part_are_used(count: int, samples: int) -> None:
    """Fifty of 3000 rows took 7 GiB: each has unknowns of its own, and a fit every sample for every unknown."""
    records = named(count, samples)
    segments, (warning,) = with_room(cut(records), [each.name for each in records])
    used = [int(each.name.removeprefix("run_")) for each in segments.records]
    assert used == sorted(set(used))
    assert MOST / 2 < len(used) ** 2 * samples <= MOST
    assert max(np.diff([-1, *used, count])) <= 2 * math.ceil(count / len(used))
    assert warning.startswith(f"{len(used)} of {count} recordings are used")
    assert len({i % 2 for i in used}) == len({i % 3 for i in used}) - 1 == 2  # kinds that take turns are all there


def test_what_there_is_room_for_is_used_whole_and_what_is_held_back_takes_none() -> None:
    records = named(50)
    segments = cut(records)
    assert with_room(segments, ["run_3", "run_5"]) == (segments, [])


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
