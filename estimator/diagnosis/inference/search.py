"""The search over sets of effects: add, drop, exchange, until no change lowers the score.

A search is a value: the sets on its way, each better than the one before, and where it ended. What it fitted is in the
memo of fits (`fits.py`); the moves from one set to the next are in `moves.py`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from estimator.diagnosis.acquisition.chain import Chain
from estimator.diagnosis.inference.figures import on_recordings
from estimator.diagnosis.inference.fits import Fits
from estimator.diagnosis.inference.hypotheses import Hypothesis, Progress, all_good_samples, open_hypotheses, silent
from estimator.diagnosis.inference.moves import better_than
from estimator.diagnosis.inference.remainder import tests
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.segments import as_slow_as_needed
from estimator.diagnosis.thresholds import Searching
from estimator.physics.model import DrivelineModel
from estimator.physics.parallel import Work
from estimator.signals.record import separated_outputs


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


def searched(
    chain: Chain,
    line: DrivelineModel,
    work: Work | None = None,
    most: float = math.inf,
    watch: Callable[[Fits], None] = lambda _fits: None,
    progress: Progress = silent,
) -> tuple[Chain, Search]:
    """Search for what is missing; once more, on readings put right, where the errors of what is found show jitter."""

    def search_of(of: Chain) -> Search:
        fitted_to = separated_outputs(as_slow_as_needed(of.records, line), noise_floor)
        names = open_hypotheses(line, of.records)[0]
        fits = Fits(line, fitted_to, all_good_samples(fitted_to), names, work=work or Work())
        watch(fits)
        return search_from_nothing(fits, most, progress)

    search = search_of(chain)
    if search.is_cut_short:
        return chain, search
    free = on_recordings(search.best, line, chain.separated, is_whole=True)
    steady = chain.with_jitter_in(free.first_outputs())
    return (chain, search) if steady is chain else (steady, search_of(steady))


def search_from_nothing(fits: Fits, most: float = math.inf, progress: Progress = silent) -> Search:
    """Search from nothing; where that way leaves more than noise, from each of the most promising first effects too.

    A later way replaces the first one where it ends at a more probable set. After ``most`` simulations it ends.
    """
    nothing = fits.nothing()
    found = _climbed(Search(fits, (nothing,)), most, progress)
    alone = [each for effects, each in fits.ended.items() if len(effects) == 1 and each.is_plausible]
    if len(found.best.effects) < 2 or not alone or not any(test.failed for test in tests(found.best)):
        return found
    nearest = sorted(alone, key=lambda each: each.score)[: Searching.STARTS]
    for first in fits.trials.worth_beginning_from(nearest):
        if first.effects <= found.best.effects:
            continue
        other = _climbed(Search(fits, (nothing, first)), most, progress, found.path)
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
        better = better_than(fits, path[-1])
        if better is None:
            break
        path = (*path, better)
    return Search(fits, path)
