"""The same recording gives the same bits, wherever its arrays lie in memory and whatever else is there."""

import numpy as np

from estimator.identification.linear_model import Orders
from estimator.identification.offline.fits import solved
from estimator.identification.offline.linearity import modes_by_region
from estimator.signals.decimate import high_passed
from tests.benchmarks.buses import draw_bus, drive

REPEATS = 6


def disturbed(rng: np.random.Generator) -> list[bytearray]:
    """Return blocks of odd sizes, to be kept; memory that is free again holds numbers of many sizes."""
    for size in range(1, 128):
        np.full(size, rng.normal() * 10.0 ** rng.integers(-300, 300))
    return [bytearray(int(size) | 1) for size in rng.integers(1, 30_000, 40)]


def test_identified_again_it_is_the_same_to_the_last_bit() -> None:
    """Two masses have two poles more than they need at order 5: columns of the Jacobian all but depend on others."""
    data, rng = high_passed(drive(draw_bus(20))), np.random.default_rng(1)
    problem, x, first = solved(data, Orders(5, 5, 1))
    kept, found = [], set()
    for _ in range(REPEATS):
        kept += disturbed(rng)
        found.add(repr(modes_by_region(problem, x, data.total_torque_nm[first:], (2.0, 40.0))))
    assert len(found) == 1
