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
from estimator.diagnosis.unnamed.hunt import Hunt, again, first, first_along_motion
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
    return judged(view, hunts_of(view, rounds))


def each_of(result: FitResult, search: Callable[[Item], Found], items: Sequence[Item]) -> list[Found]:
    """Search for laws in what a fit leaves in several ways: on all cores, or in turn where each takes much room."""
    return (concurrently if result.residual.size <= MOST_AT_ONCE else in_turn)(search, items)


def judged(view: Scene, hunts: Sequence[Hunt]) -> list[UnnamedLaw]:
    """Return what each hunt has found, weighed with one number of independent samples."""
    best = min(hunts, key=lambda hunt: hunt.mean_square)
    n = max(effective_samples(best.errors), best.ground.unknowns + MOST_COEFFICIENTS + 2.0)
    before = sum(float(error @ error) for error in view.errors)
    return [_law(hunt, n, before / best.ground.error.size) for hunt in hunts]


def hunts_of(view: Scene, rounds: int = 1, begun: Sequence[Hunt] = ()) -> list[Hunt]:
    """Look for a law at every element, and again where it is among the best.

    ``begun`` is what earlier rounds have found in the same fit, where there were any.
    """
    hunts = list(begun) or each_of(view.result, partial(first, view, ground_of(view)), elements(view.result))
    behind = max(hunt.rounds for hunt in hunts)
    if behind < 2 <= rounds:
        hunts = each_of(view.result, partial(_tried, view), hunts)
    at_rest = set[int]()
    for done in range(max(behind, 2), rounds):
        least = min(hunt.mean_square for hunt in hunts)
        near = [i for i, h in enumerate(hunts) if not h.stuck and h.mean_square <= IN_REACH**2 * least]
        further = [i for i in near if i not in at_rest]
        for i, moved in zip(further, each_of(view.result, again, [hunts[i] for i in further]), strict=True):
            had, hunts[i] = hunts[i].mean_square, moved
            if done + 1 >= LEAST_ROUNDS and moved.mean_square > (1.0 - WORTH_A_ROUND) * had:
                at_rest.add(i)
    return [replace(hunt, rounds=max(rounds, behind)) for hunt in hunts]


def _tried(view: Scene, begun: Hunt) -> Hunt:
    """Look again from the fit alone, and along the motion of an unknown input; return what simulates better."""
    starts = [begun]
    if PLACES[begun.element] is not Place.SENSOR:
        starts.append(first_along_motion(view, begun.ground, begun.element))
    return min((again(start) for start in starts), key=lambda hunt: (hunt.stuck, hunt.mean_square))


def _law(hunt: Hunt, n: float, before: float) -> UnnamedLaw:
    q = hunt.law.coefficients
    if q == 0:
        return UnnamedLaw(hunt.element, (), Gain(0.0, 1.0, n), math.sqrt(before))
    gained = hunt.law.information(before, hunt.mean_square, n)
    rest = max(n - hunt.ground.unknowns - q, 1.0)
    f_value = max(before / hunt.mean_square - 1.0, 0.0) * rest / q
    log_p = float(stats.f.logsf(f_value, q, rest)) + hunt.law.choices
    p_value = max(math.exp(min(log_p, 0.0)), SMALLEST_P)
    return UnnamedLaw(hunt.element, hunt.law.terms, Gain(gained, p_value, n), math.sqrt(hunt.mean_square))
