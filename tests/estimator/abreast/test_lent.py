"""Arrays that are lent to compiled code are what they were, without an owner to count references to."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba.core.unsafe import refcount

from estimator.abreast import lent
from estimator.compiled import IS_COMPILED, compiled
from estimator.signals.record import FloatArray

get_refcount: Any = refcount.get_refcount


@compiled
def counted(values: FloatArray, lending: bool) -> tuple[int, int]:
    """Return how many references there are before and behind five more."""
    before, others = get_refcount(values), []
    for _ in range(5):
        others.append(lent(values) if lending else values)
    return before, get_refcount(values) + 0 * len(others)


@compiled
def changed(values: FloatArray) -> FloatArray:
    own = 2.0 * values
    borrowed = lent(own)
    borrowed[0] += 1.0
    return own


def test_what_is_written_to_a_lent_array_is_the_owners() -> None:
    assert changed(np.array([1.0, 2.0])).tolist() == [3.0, 4.0]


def test_python_is_lent_the_array_itself() -> None:
    values = np.arange(3.0)
    assert lent(values) is values


@pytest.mark.skipif(not IS_COMPILED, reason="Python counts references to whatever it is given")
@pytest.mark.parametrize(("lending", "more"), [(False, 5), (True, 0)])
def test_no_references_to_a_lent_array_are_counted(lending: bool, more: int) -> None:
    before, behind = counted(np.arange(3.0), lending)
    assert behind - before == more
