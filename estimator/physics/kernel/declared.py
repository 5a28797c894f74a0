"""The laws that entries of the catalogue declare for a place, put together to one compiled function each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from estimator.compiled import assembled
from estimator.lanes import like
from estimator.physics.acting import Place
from estimator.physics.catalogue import BUILT_IN
from estimator.physics.layout import slot

Total = Callable[..., float]
"""What the place gives, and parameters of the superset model, to the sum of the place's laws [Nm]."""


Term = tuple[Callable[..., float], tuple[int, ...]]
"""A law, and the places of its parameters."""


class Sum(NamedTuple):
    """What a function that is put together adds up: laws of a place, which are given one quantity or two."""

    place: Place
    given: int
    terms: tuple[Term, ...]


SUMS: dict[Total, Sum] = {}
"""Of each function that is put together here, for who has to write it in another language."""


def taken(places: Sequence[int]) -> Callable[..., Any]:
    """Return the compiled function that takes these places out of the parameters, as a tuple."""
    first, rest = places[0], places[1:]
    if not rest:
        return assembled(lambda p: (p[first],))
    others = taken(rest)
    return assembled(lambda p: (p[first], *others(p)))


def with_law(before: Total, law: Callable[..., float], values: Callable[..., Any], given: int) -> Total:
    """Return the sum of a function and a law, of as many quantities as are ``given``."""
    if given == 1:
        return assembled(lambda x, p: before(x, p) + law(x, *values(p)))
    return assembled(lambda x, y, p: before(x, y, p) + law(x, y, *values(p)))


def total(place: Place, given: int = 1) -> Total:
    """Return the sum of all laws of a place, which are given one quantity or two."""
    if given == 1:
        summed: Total = assembled(lambda x, p: like(0.0, x))
    else:
        summed = assembled(lambda x, y, p: like(0.0, x))
    terms = terms_of(place)
    for law, slots in terms:
        summed = with_law(summed, law, taken(slots), given)
    SUMS[summed] = Sum(place, given, terms)
    return summed


def terms_of(place: Place) -> tuple[Term, ...]:
    """Return the laws that entries declare for a place, each with the places of its parameters."""
    return tuple(
        (entry.acting.law, tuple(slot(entry.name, parameter.name) for parameter in entry.parameters))
        for entry in BUILT_IN.values()
        if entry.acting is not None and entry.acting.place is place
    )


motor_drag = total(Place.MOTOR)
load_drag = total(Place.LOAD)
held_by_angle = total(Place.LOAD_ANGLE)
over_recorded_angle = total(Place.RECORDED_ANGLE)
shaft_loss = total(Place.SHAFT_LOSS, given=2)
