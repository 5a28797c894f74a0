"""The search over sets of effects: add, drop, exchange, until no change lowers the score.

A search is a value: the sets on its way, each better than the one before, and where it ended. What it fitted is in the
memo of fits (`fits.py`), the moves from one set to the next are in `moves.py`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from estimator.diagnosis.inference.checks import tests
from estimator.diagnosis.inference.fits import Fits
from estimator.diagnosis.inference.hypotheses import Hypothesis, Progress, silent
from estimator.diagnosis.inference.moves import additions, begun_elsewhere, drops, exchanges, with_free_load
from estimator.diagnosis.thresholds import Judging, Searching


@dataclass(frozen=True, slots=True)
class Search:
    """A search that has ended: the way to its best set, and all that was fitted."""

    fits: Fits  # all that were made
    path: tuple[Hypothesis, ...]  # each step's set, the last one the best
    is_cut_short: bool = False  # it ended at its limit of simulations

    @property
    def best(self) -> Hypothesis:
        """The most probable set."""
        return self.path[-1]


def search_from_nothing(fits: Fits, most: float = math.inf, progress: Progress = silent) -> Search:
    """Search from nothing; where that way leaves more than noise, from each of the most promising first effects too.

    A later way replaces the first one where it ends at a more probable set. After ``most`` simulations it ends.
    """
    found = _climbed(Search(fits, (fits.nothing(),)), most, progress)
    alone = [each for effects, each in fits.ended.items() if len(effects) == 1 and fits.is_plausible(each)]
    if len(found.best.effects) < 2 or not alone or not any(test.failed for test in tests(found.best)):
        return found
    nearest = fits.trials.of(sorted(alone, key=lambda each: each.score)[: Searching.STARTS])
    best = min(nearest, key=lambda each: each.rms)
    for first in nearest:
        if first.effects <= found.best.effects or first.is_far_behind(best):
            continue
        other = _climbed(Search(fits, (fits.nothing(), first.hypothesis)), most, progress, found.path)
        better = other if other.best.score < found.best.score else found
        found = replace(better, is_cut_short=found.is_cut_short or other.is_cut_short)
        if len(found.best.effects) < 2:
            break
    return found


def _climbed(start: Search, most: float, progress: Progress, rival: Sequence[Hypothesis] = ()) -> Search:
    """Return a way on which each set is better than the one before, to where no change lowers the score.

    It is given up where, from its second effect on, a set is worse than one of as few effects on a rival's way.
    """
    fits, path = start.fits, start.path
    for _ in range(2 * Searching.MOST_EFFECTS):
        progress("comparing hypotheses", 0.1 + 0.7 * len(path) / (len(path) + 3))
        if fits.simulations >= most:
            return Search(fits, path, is_cut_short=True)
        count = len(path[-1].effects)
        if count > 1 and any(len(each.effects) <= count and each.score < path[-1].score for each in rival):
            break
        better = _better(fits, path[-1])
        if better is None:
            break
        path = (*path, better)
    return Search(fits, path)


def _better(fits: Fits, current: Hypothesis) -> Hypothesis | None:
    """Return the set that a search goes to from one; None where no move leads to a better one."""
    again = _most_probable(fits, begun_elsewhere(fits, current), current)
    if again is not None:
        return again
    may_grow = len(current.effects) < Searching.MOST_EFFECTS and not _leaves_a_trace_at_most(fits, current)
    larger = (
        [each for each in additions(fits, current) if fits.trials.is_worth_adding(each, current)] if may_grow else []
    )
    if (grown := _most_probable(fits, larger, current)) is not None:
        return grown
    smaller = drops(fits, current)
    return (
        _most_probable(fits, smaller, current)
        or _as_good(fits, smaller, current)
        or _most_probable(fits, exchanges(fits, current), current)
        or _most_probable(fits, with_free_load(fits, current), current)
    )


def _leaves_a_trace_at_most(fits: Fits, current: Hypothesis) -> bool:
    """Tell whether what a set leaves beyond the noise is so little that no further law could be more than a trace."""
    if not current.effects:
        return False
    nothing, its = fits.trials.of([fits.nothing(), current])
    return float(its.excess(fits.noise).sum()) < Judging.LEAST_SHARE * float(nothing.excess(fits.noise).sum())


def _most_probable(fits: Fits, found: Sequence[Hypothesis], current: Hypothesis) -> Hypothesis | None:
    better = [each for each in found if each.score < current.score and fits.is_plausible(each)]
    return min(better, key=lambda each: each.score, default=None)


def _as_good(fits: Fits, smaller: Sequence[Hypothesis], current: Hypothesis) -> Hypothesis | None:
    """Return the set of fewer laws that simulates as well, the best of several."""
    if not smaller:
        return None
    whole = fits.trials.one(current)
    as_good = [each for each in fits.trials.of(smaller) if each.beats(whole) and fits.is_plausible(each.hypothesis)]
    return min(as_good, key=lambda each: each.rms).hypothesis if as_good else None
