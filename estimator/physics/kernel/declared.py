"""The laws that entries of the catalogue declare for a place, put together to one compiled function each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from estimator.abreast import like
from estimator.compiled import assembled
from estimator.physics.acting import Place
from estimator.physics.catalogue import BUILT_IN
from estimator.physics.layout import slot

Total = Callable[..., float]
"""What the place gives, and parameters of the superset model, to the sum of the place's laws [Nm]."""


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
    for entry in BUILT_IN.values():
        if entry.acting is not None and entry.acting.place is place:
            values = taken([slot(entry.name, parameter.name) for parameter in entry.parameters])
            summed = with_law(summed, entry.acting.law, values, given)
    return summed


motor_drag = total(Place.MOTOR)
load_drag = total(Place.LOAD)
held_by_angle = total(Place.LOAD_ANGLE)
over_recorded_angle = total(Place.RECORDED_ANGLE)
shaft_loss = total(Place.SHAFT_LOSS, given=2)
