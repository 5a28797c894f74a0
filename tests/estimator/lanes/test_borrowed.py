"""Arrays that compiled code borrows are what they were, without an owner to count references to."""

from typing import Any

import numpy as np
import pytest
from numba.core.unsafe import refcount

from estimator.compiled import IS_COMPILED, compiled
from estimator.lanes import borrowed
from estimator.signals.record import FloatArray

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
