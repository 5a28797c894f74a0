"""An estimator's memory: one record, whose parts are views and whose type tells compiled code every shape."""

from __future__ import annotations

import numpy as np
import pytest

from estimator.identification.linear_model import Orders
from estimator.identification.online.oefo import Oefo
from estimator.identification.online.recursive import Memory


@pytest.fixture
def memory() -> Memory:
    return Memory({"theta": (3,), "U": (3, 3), "none": (0,)}, {"law": np.array([0.5, 2.0])}, {"work": (3,)})


def test_a_part_is_a_view_of_the_record(memory: Memory) -> None:
    memory["U"][1, 2] = 7.0
    assert memory.record["U"][0, 1, 2] == 7.0
    assert memory["none"].shape == (0,)


def test_what_is_kept_and_settings_are_copies_and_room_is_neither(memory: Memory) -> None:
    assert list(memory.kept) == ["theta", "U", "none"]
    assert memory.settings["law"].tolist() == [0.5, 2.0]
    memory.kept["theta"][:] = 1.0
    memory.settings["law"][:] = 1.0
    assert memory["theta"].tolist() == [0.0] * 3
    assert memory["law"].tolist() == [0.5, 2.0]


def test_the_same_shapes_are_the_same_type_so_that_they_share_their_code(memory: Memory) -> None:
    again = Memory({"theta": (3,), "U": (3, 3), "none": (0,)}, {"law": np.zeros(2)}, {"work": (3,)})
    longer = Memory({"theta": (4,), "U": (3, 3), "none": (0,)}, {"law": np.zeros(2)}, {"work": (3,)})
    assert again.record.dtype == memory.record.dtype != longer.record.dtype


def test_structures_side_by_side_keep_to_themselves() -> None:
    """Each structure has code of its own: the results of one do not depend on which others there are."""
    rng = np.random.default_rng(0)
    u, y, okay = rng.normal(size=200), rng.normal(size=200), np.ones(200, dtype=np.bool_)
    orders = (Orders(2, 3, 0), Orders(0, 2, 1), Orders(2, 2, 1))
    alone = [Oefo(np.ones(1), of).run(u, y, okay).theta for of in orders]
    estimators = [Oefo(np.ones(1), of) for of in orders]
    for k in range(200):
        companion = [estimator.update(u[k], y[k]).theta for estimator in estimators]
    for theta, last in zip(alone, companion, strict=True):
        assert np.array_equal(theta[-1], last)
