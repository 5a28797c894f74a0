"""What follows from a recording alone is worked out once, and forgotten with the recording."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TypeVar
from weakref import WeakKeyDictionary

Object = TypeVar("Object")
Result = TypeVar("Result")


def once(function: Callable[[Object], Result]) -> Callable[[Object], Result]:
    """Remember what a function returns for each object, as long as that lives.

    Only for objects that are told apart by what they are and not by what they hold, and never change. What is returned
    is shared: nobody may write to it.
    """
    known: WeakKeyDictionary[Object, Result] = WeakKeyDictionary()

    @wraps(function)
    def remembered(of: Object) -> Result:
        try:
            return known[of]
        except KeyError:
            return known.setdefault(of, function(of))

    return remembered
