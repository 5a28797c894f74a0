"""The rival that every name must beat: a law without a name, found by sparse regression at one place of the chain.

At every element the best sparse sum of simple functions is looked for; the BIC decides how many, each paying for its
coefficients and for having been chosen among many. All elements are judged with one number of independent samples, that
of the rival that leaves least: how correlated a rival's error is must not decide.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

from scipy import stats

from estimator.diagnosis.line import PLACES, Place
from estimator.diagnosis.noise import SMALLEST_P, Gain, noise_floor
from estimator.diagnosis.unnamed.element_search import ElementSearch, again, first, first_along_motion
from estimator.diagnosis.unnamed.pursuit import MOST_COEFFICIENTS
from estimator.diagnosis.unnamed.scene import Scene, elements, ground_of, scene
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.parallel import concurrently, in_turn
from estimator.signals.correlation import effective_samples

Item = TypeVar("Item")
Found = TypeVar("Found")

ROUNDS = 20
"""Rounds that locate, at most: the first promises, the others try what it promised."""

LEAST_ROUNDS = 5
WORTH_A_ROUND = 0.005
"""Rounds that are made in any case, and the share of the squared error that a further one must have taken away at an
element for its next: where the line's own parameters are far off, as next to a shaft that relaxes, law and line come to
each other in many steps."""

MOST_AT_ONCE = 20_000
"""Samples up to which several searches are made at a time: functions and answers take some 4 kB a sample each."""

IN_REACH = 3.0
"""Elements whose law leaves more than this many times the RMS of the best are not looked at again."""


@dataclass(frozen=True, slots=True)
class UnnamedLaw:
    """The best law at one element: its terms and coefficients, what it gains, and the RMS it would leave.

    A term with several coefficients, a free function or waves, is given by the RMS of what it does.
    """

    element: Element
    terms: tuple[tuple[str, float], ...]
    gain: Gain
    rms: float


def best_unnamed(result: FitResult, rounds: int = 1) -> UnnamedLaw | None:
    """Return the law without a name that gains most over a fit; None where no candidate gains anything."""
    return best_of(unnamed_laws(result, rounds))


def best_of(laws: Sequence[UnnamedLaw]) -> UnnamedLaw | None:
    """Return the law that gains most, of those that gain anything."""
    found = [law for law in laws if law.gain.delta_bic > 0]
    return max(found, key=lambda law: law.gain.delta_bic, default=None)


def unnamed_laws(result: FitResult, rounds: int = 1) -> list[UnnamedLaw]:
    """Return the best law of each element that has candidates."""
    view = scene(result, noise_floor(result.problem.records))
    return judged(view, searches_at(view, rounds))


def each_of(result: FitResult, search: Callable[[Item], Found], items: Sequence[Item]) -> list[Found]:
    """Search for laws in what a fit leaves in several ways: on all cores, or in turn where each takes much room."""
    return (concurrently if result.residual.size <= MOST_AT_ONCE else in_turn)(search, items)


def judged(view: Scene, searches: Sequence[ElementSearch]) -> list[UnnamedLaw]:
    """Return what each state has found, weighed with one number of independent samples."""
    best = min(searches, key=lambda state: state.mean_square)
    n = max(effective_samples(best.errors), best.ground.unknowns + MOST_COEFFICIENTS + 2.0)
    before = sum(float(error @ error) for error in view.errors)
    return [_law(state, n, before / best.ground.error.size) for state in searches]


def searches_at(view: Scene, rounds: int = 1, begun: Sequence[ElementSearch] = ()) -> list[ElementSearch]:
    """Look for a law at every element, and again where it is among the best.

    ``begun`` is what earlier rounds have found in the same fit, where there were any.
    """
    searches = list(begun) or each_of(view.result, partial(first, view, ground_of(view)), elements(view.result))
    behind = max(state.rounds for state in searches)
    if behind < 2 <= rounds:
        searches = each_of(view.result, partial(_tried, view), searches)
    at_rest = set[int]()
    for done in range(max(behind, 2), rounds):
        least = min(state.mean_square for state in searches)
        near = [i for i, h in enumerate(searches) if not h.stuck and h.mean_square <= IN_REACH**2 * least]
        further = [i for i in near if i not in at_rest]
        for i, moved in zip(further, each_of(view.result, again, [searches[i] for i in further]), strict=True):
            had, searches[i] = searches[i].mean_square, moved
            if done + 1 >= LEAST_ROUNDS and moved.mean_square > (1.0 - WORTH_A_ROUND) * had:
                at_rest.add(i)
    return [replace(state, rounds=max(rounds, behind)) for state in searches]


def _tried(view: Scene, begun: ElementSearch) -> ElementSearch:
    """Look again from the fit alone, and along the motion of an unknown input; return what simulates better."""
    starts = [begun]
    if PLACES[begun.element] is not Place.SENSOR:
        starts.append(first_along_motion(view, begun.ground, begun.element))
    return min((again(start) for start in starts), key=lambda state: (state.stuck, state.mean_square))


def _law(state: ElementSearch, n: float, before: float) -> UnnamedLaw:
    q = state.law.coefficients
    if q == 0:
        return UnnamedLaw(state.element, (), Gain(0.0, 1.0, n), math.sqrt(before))
    gained = state.law.information(before, state.mean_square, n)
    rest = max(n - state.ground.unknowns - q, 1.0)
    f_value = max(before / state.mean_square - 1.0, 0.0) * rest / q
    log_p = float(stats.f.logsf(f_value, q, rest)) + state.law.choices
    p_value = max(math.exp(min(log_p, 0.0)), SMALLEST_P)
    return UnnamedLaw(state.element, state.law.terms, Gain(gained, p_value, n), math.sqrt(state.mean_square))
