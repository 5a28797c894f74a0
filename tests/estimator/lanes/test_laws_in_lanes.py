"""Every law in every lane is what it is alone, on whichever side of its edges each lane is."""

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import numba
import numpy as np
import pytest
from numba.core.unsafe import refcount

from estimator.compiled import IS_COMPILED, compiled
from estimator.lanes import borrowed
from estimator.physics import laws
from estimator.physics.effects.drag import quadratic_law, warming_law
from estimator.physics.effects.dry_friction import brake_law, stribeck_law
from estimator.physics.effects.inertia import with_more_law
from estimator.physics.effects.load import carcass, coupling, gripped
from estimator.physics.effects.sensor import blind_law, resolver_law
from estimator.physics.effects.shaft import cracked_law, damping_share, loading_rate, pressed, stiffness_factor
from estimator.signals.record import FloatArray
from tests.chosen import one_in
from tests.estimator.lanes.bench import in_both_ways

EITHER_SIDE = (-25.0, -0.7, -0.01, 0.0, 0.3, 0.625, 1.0, 45.0)
SIZES = (0.0, 1e-3, 0.4, 1.0, 3.0, 50.0)


def _slope(vehicle: float, slip: float, creep: float, wheel: float, steepest: float) -> float:
    return coupling(vehicle, slip, creep, wheel, steepest)[0]


def _share(vehicle: float, slip: float, creep: float, wheel: float, steepest: float) -> float:
    return coupling(vehicle, slip, creep, wheel, steepest)[1]


LAWS: list[tuple[Callable[..., Any], Sequence[Sequence[float]]]] = [
    (laws.hyperbolic_tangent, [EITHER_SIDE]),
    (laws.power, [SIZES, (-2.0, -0.3, 0.2, 1.0, 3.0)]),
    (laws.fading, [SIZES]),
    (laws.dry_friction, [EITHER_SIDE, SIZES, (0.01, 1.0)]),
    (laws.beyond_gap, [EITHER_SIDE, SIZES]),
    (laws.share_inside, [EITHER_SIDE, (0.1, 2.0), (-1.0, 0.5), (0.6, 4.0)]),
    (laws.inertia_while, [(1.0, 30.0), (-0.2, 5.0), (0.0, 0.4, 1.0)]),
    (laws.overtoned_wave, [SIZES, EITHER_SIDE, (0.0, 2.0), (0.0, 0.3), (0.0, -0.2)]),
    (laws.wave, [SIZES, EITHER_SIDE, (0.0, 2.0)]),
    (damping_share, [EITHER_SIDE, SIZES]),
    (quadratic_law, [EITHER_SIDE, (0.0, 3.0), (1.7, 2.0, 2.1), (0.5, 40.0)]),
    (pressed, [EITHER_SIDE, EITHER_SIDE, (0.0, 0.5, 1.0)]),
    (loading_rate, [(-1.2, -0.5, 0.0, 0.9), EITHER_SIDE, (0.3, 2.0), (0.0, 0.8), (5.0, 600.0)]),
    (stiffness_factor, [EITHER_SIDE, (-2.0, 0.0, 30.0), (0.5, 1.0, 2.0)]),
    (stribeck_law, [EITHER_SIDE, (0.0, 4.0), (3.0,), (0.0, 0.5, 2.0), (0.0,), (0.0,)]),
    (brake_law, [(0.0, 3.0), (0.1, 2.0), SIZES, (0.0,), (0.0,), (-1.0, 0.5), (0.6, 4.0)]),
    (carcass, [EITHER_SIDE, EITHER_SIDE, (3.0,), (0.2, 5.0)]),
    (gripped, [EITHER_SIDE, (2.0,), (0.0, 0.5)]),
    (_slope, [EITHER_SIDE, (1e-3, 0.2), (0.1, 4.0), (0.005, 0.3), (5.0, 400.0)]),
    (_share, [EITHER_SIDE, (1e-3, 0.2), (0.1, 4.0), (0.005, 0.3), (5.0, 400.0)]),
    (warming_law, [(0.7,), (0.0, 3.0, 600.0), (0.01,), SIZES, (20.0, 300.0), (0.0, 0.4)]),
    (with_more_law, [(1.0, 30.0), (0.0, 3.0), (0.1, 2.0), (0.0, 5.0), (-1.0, 0.5), (0.6, 4.0)]),
    (cracked_law, [(900.0,), (0.0, 3.0), (0.1, 2.0), (-0.2, 0.0, 0.5), (-1.0, 0.5), (0.6, 4.0)]),
    (resolver_law, [EITHER_SIDE, (0.3, 40.0), (0.0, 0.01), (0.0, 0.02), (0.4,), (-1.0,)]),
    (blind_law, [EITHER_SIDE, (0.0, 0.4, 1.0)]),
]


@pytest.mark.parametrize(("law", "values"), one_in(3, LAWS), ids=lambda value: getattr(value, "__name__", ""))
def test_a_law_is_the_same_in_every_lane(law: Callable[..., Any], values: Sequence[Sequence[float]]) -> None:
    grid = np.array(list(itertools.product(*values)))
    shuffled = np.random.default_rng(3).permutation(grid)  # so that lanes differ in every argument
    sorted_too = np.vstack([shuffled, grid, grid[: -2 * len(grid) % 8]])  # and agree in some
    compiled = law if hasattr(law, "py_func") else numba.njit(error_model="numpy")(law)
    with np.errstate(invalid="ignore"):
        together, alone = in_both_ways(compiled, tuple(sorted_too.T))
    np.testing.assert_allclose(together, alone, rtol=1e-13, atol=1e-15 * np.abs(alone).max())


get_refcount: Any = refcount.get_refcount


@compiled
def counted(values: FloatArray, borrowing: bool) -> tuple[int, int]:
    """Return how many references there are before and behind five more."""
    before, others = get_refcount(values), []
    for _ in range(5):
        others.append(borrowed(values) if borrowing else values)
    return before, get_refcount(values) + 0 * len(others)


@compiled
def changed(values: FloatArray) -> FloatArray:
    own = 2.0 * values
    taken = borrowed(own)
    taken[0] += 1.0
    return own


def test_what_is_written_to_a_borrowed_array_is_the_owners() -> None:
    assert changed(np.array([1.0, 2.0])).tolist() == [3.0, 4.0]


def test_python_borrows_the_array_itself() -> None:
    values = np.arange(3.0)
    assert borrowed(values) is values


@pytest.mark.skipif(not IS_COMPILED, reason="Python counts references to whatever it is given")
@pytest.mark.parametrize(("borrowing", "more"), [(False, 5), (True, 0)])
def test_no_references_to_a_borrowed_array_are_counted(borrowing: bool, more: int) -> None:
    before, behind = counted(np.arange(3.0), borrowing)
    assert behind - before == more
