"""Arithmetic in lanes is that of single numbers."""

import math
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import pytest

from estimator.lanes import broadcast_as, choose, every, some
from tests.chosen import campaign
from tests.estimator.lanes.bench import in_both_ways

RNG = np.random.default_rng(5)
X, Y = RNG.normal(0.0, 3.0, 64), RNG.normal(0.0, 3.0, 64)


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    return numba.njit(error_model="numpy")(function)


@pytest.mark.parametrize(
    "function",
    [
        lambda x, y: x + y - 2.0,
        campaign(lambda x, y: 3 * x - y),
        campaign(lambda x, y: x * y),
        lambda x, y: x / y,
        campaign(lambda x, y: -abs(x) + float(y)),
        lambda x, y: min(x, y) + max(x, 0.5),
        lambda x, y: math.copysign(x, y) + math.sqrt(abs(y)),
        lambda x, y: choose(x < y, x, choose(x * y > 4.0, 7.0, y)),
        lambda x, y: choose((x <= y) & (y >= 0.0), 1.0, 2.0) + choose((x > 1.0) | (y > 1.0), 4.0, 8.0),
        lambda x, y: choose(x == x, 1.0, 0.0) + choose(x != y, 2.0, 0.0),
    ],
)
def test_operations_are_those_of_one_number(function: Callable[..., Any]) -> None:
    together, alone = in_both_ways(compiled(function), (X, Y))
    np.testing.assert_allclose(together, alone, rtol=1e-15, atol=1e-15)  # a product in a sum may be rounded once


def test_every_and_some_ask_all_lanes() -> None:
    """Of one number they are its own answer, of eight a common one."""
    asked = compiled(lambda x: broadcast_as(1.0 if every(x > 0.0) else 2.0 if some(x > 0.0) else 3.0, x))
    for values, answer in ((np.ones(8), 1.0), (np.arange(8.0), 2.0), (-np.ones(8), 3.0)):
        together, alone = in_both_ways(asked, (values,))
        assert np.all(together == answer)
        assert np.array_equal(alone, np.where(values > 0.0, 1.0, 3.0))


def test_a_variable_is_one_number_first_and_lanes_later() -> None:
    @compiled
    def total(x: float) -> float:
        value = 0.0
        for _ in range(3):
            value += x
        return value

    together, alone = in_both_ways(total, (X,))
    assert np.array_equal(together, alone)


@pytest.mark.parametrize(
    ("function", "low", "high"),
    [
        (math.exp, -700.0, 700.0),
        campaign((math.exp, -1.0, 1.0)),
        (math.log, 1e-300, 1e300),
        campaign((math.log, 0.5, 2.0)),
    ],
)
def test_elementary_functions_are_right_to_rounding(
    function: Callable[[float], float], low: float, high: float
) -> None:
    """Against the C library's, which are right to the last bit but one."""
    logs = low > 0.0
    x = np.exp(RNG.uniform(np.log(low), np.log(high), 4096)) if logs else RNG.uniform(low, high, 4096)
    together, alone = in_both_ways(compiled(lambda x: function(x)), (x,))
    np.testing.assert_allclose(together, alone, rtol=4e-16 * 4, atol=4e-16 if logs else 0.0)


def test_waves_are_those_of_the_library() -> None:
    together, alone = in_both_ways(compiled(lambda x: math.cos(x) + 2.0 * math.sin(x)), (X,))
    np.testing.assert_allclose(together, alone, rtol=0.0, atol=1e-14)
