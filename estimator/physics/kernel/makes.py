"""From parameters to the make of their line: a simulation is compiled for each make, and what one lacks costs nothing.

``made`` is that simulation, a compiled function of a `Line` and of what is ``given`` to it. The functions here become
part of their caller before it is compiled. Else each would be optimised by itself, with the simulation of every make in
it, which took nearly half of the time.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from estimator.compiled import ir_inlined
from estimator.physics.kernel import slots
from estimator.physics.kernel.line import Line, is_elastic, is_extended
from estimator.signals.record import FloatArray

Made = Callable[..., None]

Masses = tuple[int, ...]
"""An entry for each mass. Its length is a part of its type, so that only makes of so many masses are compiled."""


@ir_inlined
def for_its_make(masses: int, own: tuple[Any, ...], made: Made, p: FloatArray, given: tuple[Any, ...]) -> None:
    """Call what is compiled for the make of the line that has these parameters, of 1, 2 or 3 masses."""
    if masses == 1:
        _for_its_states(1, True, own, made, p, given)
    elif masses == 2:
        _for_its_shaft(2, own, made, p, given)
    else:
        _for_its_shaft(3, own, made, p, given)


@ir_inlined
def _for_its_shaft(masses: int, own: tuple[Any, ...], made: Made, p: FloatArray, given: tuple[Any, ...]) -> None:
    if is_elastic(p):
        _for_its_states(masses, True, own, made, p, given)
    else:
        _for_its_states(masses, False, own, made, p, given)


@ir_inlined
def _for_its_states(
    masses: int, elastic: bool, own: tuple[Any, ...], made: Made, p: FloatArray, given: tuple[Any, ...]
) -> None:
    if is_extended(p):
        made(Line(masses, elastic, not elastic, True, own), *given)
    elif not elastic and p[slots.SLIDER] != 0.0:
        made(Line(masses, elastic, True, False, own), *given)
    else:
        made(Line(masses, elastic, False, False, own), *given)
