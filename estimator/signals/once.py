"""What follows from a recording alone is worked out once, and forgotten with the recording."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TypeVar
from weakref import WeakKeyDictionary

import numpy as np

Object = TypeVar("Object")
Result = TypeVar("Result")

MOST_BYTES = 2**20
"""Size of an array that is kept, at most: what is asked for again and again is of stretches, not of whole hours."""


def once(function: Callable[[Object], Result]) -> Callable[[Object], Result]:
    """Remember what a function returns for each object, as long as that lives; arrays of more than ``MOST_BYTES`` not.

    Only for objects that are distinguished by what they are and not by what they hold, and never change. What is
    returned is shared: nobody may write to it.
    """
    known: WeakKeyDictionary[Object, Result] = WeakKeyDictionary()

    @wraps(function)
    def remembered(of: Object) -> Result:
        try:
            return known[of]
        except KeyError:
            result = function(of)
        if isinstance(result, np.ndarray) and result.nbytes > MOST_BYTES:
            return result
        return known.setdefault(of, result)

    return remembered
