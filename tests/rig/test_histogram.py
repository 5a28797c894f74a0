"""Bounded histograms of times: quantiles from above, by a known part, and the longest time exactly."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hil.rig.timing import Histogram

WIDEST = 1.0 / 128.0


def filled(times_ns: list[int]) -> Histogram:
    histogram = Histogram()
    for time_ns in times_ns:
        histogram.add(time_ns)
    return histogram


@given(st.lists(st.integers(0, 10**12), min_size=1, max_size=200), st.sampled_from((0.01, 0.5, 0.99, 0.999, 1.0)))
def test_quantile_is_the_nearest_rank_or_slightly_more(times_ns: list[int], share: float) -> None:
    exact = sorted(times_ns)[max(1, math.ceil(share * len(times_ns))) - 1]
    reported = filled(times_ns).quantile_ns(share)
    assert reported is not None
    assert exact <= reported <= exact * (1.0 + WIDEST) + 1e-9
    assert reported <= max(times_ns)


def test_the_longest_time_is_exact_and_nothing_is_lost() -> None:
    times_ns = [round(x) for x in np.random.default_rng(3).lognormal(13.0, 3.0, 5000)]
    histogram = filled(times_ns)
    assert histogram.max_ns == max(times_ns)
    assert histogram.total == sum(count for _, count in histogram.bins()) == 5000
    edges = [edge for edge, _ in histogram.bins()]
    assert edges == sorted(set(edges))
