"""The small pieces that laws share, against the mathematics they stand for."""

import math

import numpy as np
import pytest

from estimator.physics.laws import BEYOND, hyperbolic_tangent, power

LAST_BIT = np.finfo(float).eps


def test_the_hyperbolic_tangent_is_the_librarys_to_the_last_two_bits() -> None:
    sizes = np.concatenate([np.geomspace(1e-300, 2.0 * BEYOND, 20_000), np.linspace(0.0, 1.1 * BEYOND, 20_000)[1:]])
    for size in sizes:
        assert hyperbolic_tangent(size) == pytest.approx(math.tanh(size), rel=2.0 * LAST_BIT, abs=0.0)
        assert hyperbolic_tangent(-size) == -hyperbolic_tangent(size)


@pytest.mark.parametrize("exponent", [0.3, 1.0, 2.0, -0.5, 7.5])
def test_a_power_is_the_librarys_to_13_digits(exponent: float) -> None:
    for size in np.concatenate([np.geomspace(1e-6, 1e3, 5_000), [1.0]]):
        assert power(size, exponent) == pytest.approx(size**exponent, rel=1e-13, abs=0.0)
