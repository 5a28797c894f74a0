"""Black boxes find what is theirs: a difference equation with a product in it, and a linear one."""

import numpy as np
import pytest

from estimator.signals.record import FloatArray
from tests.benchmarks.black_boxes import box_jenkins, narx, products, sparse, split
from tests.estimator.physics.bench import random_steps, record

NOISE = 1e-4


def answered(torque: FloatArray, bent: float) -> FloatArray:
    output = np.zeros(torque.size)
    for k in range(2, torque.size):
        output[k] = 1.4 * output[k - 1] - 0.6 * output[k - 2] + 0.02 * torque[k - 1] - bent * output[k - 1] ** 2
    return output + NOISE * np.random.default_rng(3).standard_normal(torque.size)


@pytest.mark.parametrize("bent", [0.0, 0.02])
def test_each_simulates_what_it_is_made_for(bent: float) -> None:
    torques = [random_steps(800, seed=seed, size_nm=10.0, hold=20) for seed in (1, 2)]
    records = [record(torque, answered(torque, bent), name=f"run_{i}") for i, torque in enumerate(torques)]
    of = split(records)
    assert narx(of) < 0.1
    assert sparse(of) < 0.1
    linear = box_jenkins(of)
    assert linear < 0.01 if bent == 0.0 else linear > narx(of)


def test_products_are_all_there_are_up_to_a_degree() -> None:
    assert products(2).shape == (45, 2)
    assert products(3).shape == (165, 3)
