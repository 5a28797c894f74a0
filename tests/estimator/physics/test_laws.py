"""The small pieces that laws share, against the mathematics they stand for."""

import math

import numpy as np
import pytest

from estimator.physics.laws import BENT, BEYOND, NOTHING_LEFT, fading, hyperbolic_tangent, power

LAST_BIT = np.finfo(float).eps


def test_the_hyperbolic_tangent_is_the_librarys_to_the_last_two_bits() -> None:
    sizes = np.concatenate([np.geomspace(1e-300, 2.0 * BEYOND, 20_000), np.linspace(0.0, 1.1 * BEYOND, 20_000)[1:]])
    for size in sizes:
        assert hyperbolic_tangent(size) == pytest.approx(math.tanh(size), rel=2.0 * LAST_BIT, abs=0.0)
        assert hyperbolic_tangent(-size) == -hyperbolic_tangent(size)


@pytest.mark.parametrize("edge", [BENT, BEYOND])
def test_the_hyperbolic_tangent_does_not_fall_where_its_form_changes(edge: float) -> None:
    below, above = math.nextafter(edge, 0.0), math.nextafter(edge, math.inf)
    assert hyperbolic_tangent(below) <= hyperbolic_tangent(above) <= hyperbolic_tangent(below) + 2.0 * LAST_BIT


def test_the_hyperbolic_tangent_of_what_runs_away() -> None:
    assert (hyperbolic_tangent(0.0), hyperbolic_tangent(math.inf), hyperbolic_tangent(-math.inf)) == (0.0, 1.0, -1.0)
    assert math.isnan(hyperbolic_tangent(math.nan))


@pytest.mark.parametrize("exponent", [0.3, 1.0, 2.0, -0.5, 7.5])
def test_a_power_is_the_librarys_to_13_digits(exponent: float) -> None:
    for size in np.concatenate([np.geomspace(1e-6, 1e3, 5_000), [1.0]]):
        assert power(size, exponent) == pytest.approx(size**exponent, rel=1e-13, abs=0.0)


def test_a_power_of_nothing_is_nothing() -> None:
    assert power(0.0, 0.3) == 0.0


def test_what_fades_is_exponential_until_it_is_lost_next_to_one() -> None:
    assert [fading(x) for x in (0.0, 1.0, 30.0)] == pytest.approx([1.0, math.exp(-1.0), math.exp(-30.0)], rel=1e-15)
    assert fading(NOTHING_LEFT) == 0.0
    assert 1.0 - math.exp(-NOTHING_LEFT) == 1.0
