"""Moves: from one set of effects to the next, by an effect added, dropped, started elsewhere or exchanged.

Each move returns the sets that it leads to, fitted; `better_than` takes the first of them that is better. Effects are
not fitted in turn: a score test around the present fit says what each one promises, and the most promising are fitted a
few steps, the best of these to their end.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimator.diagnosis.inference.fits import Fits
from estimator.diagnosis.inference.hypotheses import GRADE, Hypothesis, open_hypotheses
from estimator.diagnosis.inference.remainder import tests
from estimator.diagnosis.inference.score_tests import ScoredStart, Screen, WeightedScoreTests, promising
from estimator.diagnosis.priors import EffectPriors
from estimator.diagnosis.thresholds import Searching
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.jacobian import jacobian_at
from estimator.physics.layout import slot
from estimator.physics.parallel import concurrently
from estimator.physics.problem import start_of
from estimator.physics.simulate import simulate
from estimator.physics.steps import Moments, moments_of
from estimator.physics.unknowns import Release

BLIND = "speed_sign_blind"

Starts = Mapping[str, Sequence[ScoredStart]]


def better_than(fits: Fits, current: Hypothesis) -> Hypothesis | None:
    """Return the set that a search goes to from one; None where no move leads to a better one."""
    again = _most_probable(fits, begun_elsewhere(fits, current), current)
    if again is not None:
        return again
    is_done = fits.trials.leaves_a_trace_at_most(current, fits.nothing(), fits.noise)
    may_grow = len(current.effects) < Searching.MOST_EFFECTS and not is_done
    larger = additions(fits, current) if may_grow else []
    larger = [each for each in larger if fits.trials.is_worth_adding(each, current)]
    if (grown := _most_probable(fits, larger, current)) is not None:
        return grown
    smaller = drops(fits, current)
    return (
        _most_probable(fits, smaller, current)
        or fits.trials.as_good(smaller, current)
        or _most_probable(fits, exchanges(fits, current), current)
        or _most_probable(fits, with_free_load(fits, current), current)
    )


def _most_probable(fits: Fits, found: Sequence[Hypothesis], current: Hypothesis) -> Hypothesis | None:
    better = [each for each in found if each.score < current.score and each.is_plausible]
    return min(better, key=lambda each: each.score, default=None)


def additions(fits: Fits, current: Hypothesis) -> list[Hypothesis]:
    """Return sets with one effect more, the best few fitted to their end.

    Where a set leaves what noise would leave, only effects are fitted that promise more than they cost.
    """
    view, is_more = fits.view(current), any(test.failed for test in tests(current))
    looked = _looked(view, [name for name in _open(fits, current) if name not in current.effects], current)
    price = _price(current)
    fits.foreseen.update({name: current.score - starts[0].promise + price for name, starts in looked.items()})
    some = Searching.FEWEST_FITS if is_more else 0
    starts = {
        **_worth_fitting(current, looked, some=some),
        **_at_moments(view, looked, _promised_moments(looked), price),
    }
    fits.learn(current, view)
    missed = _most_missed(fits, current, list(looked)) if is_more else []
    missed = [each for each in missed if _is_elsewhere(*each, starts)]
    tried = [*starts.items(), *((name, [start]) for name, start in missed)]
    rough = concurrently(lambda each: fits.added(current, *each), tried)
    most = Searching.FINISHED if current.effects else Searching.STARTS
    found = sorted((each for each in rough[: len(starts)] if each is not None), key=lambda each: each.score)
    near = [each for each in found[:most] if _may_be_best(each, found[0], current)]
    near += [each for each in rough[len(starts) :] if each is not None]
    finished = concurrently(lambda each: fits.finish(each, current), near)
    is_event = any(_is_event_of_load(name) for each in near for name in each.effects - current.effects)
    return finished + (with_free_load(fits, current) if is_event else [])


def begun_elsewhere(fits: Fits, current: Hypothesis) -> list[Hypothesis]:
    """Return the same set from the best other start, once for each of its effects.

    Laws are written other ways, events looked for in other stretches of the recordings.
    """
    found: list[Hypothesis | None] = []
    for name in sorted(current.effects - {GRADE}):
        if fits.is_first("started elsewhere", current.effects, name):
            found.append(fits.rewritten(current, name))
            if EFFECTS[name].event:
                found.append(fits.elsewhere(current, name))
    better = [each for each in found if each is not None and each.is_plausible]
    return [fits.finish(min(better, key=lambda each: each.score), current)] if better else []


def with_free_load(fits: Fits, current: Hypothesis) -> list[Hypothesis]:
    """Return a set with a load that walks far, where it is among the effects: after all laws, of which it has none."""
    return [fits.with_grade(current)] if GRADE in fits.names and GRADE not in current.effects else []


def drops(fits: Fits, current: Hypothesis) -> list[Hypothesis]:
    """Return the sets without each of the effects: fitted anew from there, fewer laws may find a better optimum."""
    return concurrently(lambda name: fits.without(current, name), sorted(current.effects))


def exchanges(fits: Fits, current: Hypothesis) -> list[Hypothesis]:
    """Return the best set with a look-alike in the place of each effect, where one comes near."""
    found = concurrently(lambda name: _nearest(fits, current, name), sorted(current.effects))
    for _, reduced, view in found:
        fits.learn(reduced, view)
    return [each for each, _, _ in found if each is not None]


def fit_look_alikes(fits: Fits, best: Hypothesis) -> None:
    """Fit to their end what came near in the place of an effect, so that each look-alike has its own values."""
    for effects, rough in sorted(fits.rough.items(), key=lambda item: sorted(item[0])):
        exchanged = len(effects) == len(best.effects) and len(effects & best.effects) == len(effects) - 1
        if exchanged and effects not in fits.ended:
            gone = next(iter(best.effects - effects))
            if rough.score < best.score + Searching.NEARLY * _gain(best, fits.without(best, gone)):
                fits.finish(rough, best)


def _looked(view: Screen, names: Sequence[str], around: Hypothesis) -> dict[str, list[ScoredStart]]:
    """Return what a score test promises of each start of some effects; what a more general law has is not asked."""
    contained = {special for have in around.effects for special in EFFECTS[have].contains}
    tried = [name for name in names if name != GRADE and name not in contained]
    return dict(zip(tried, concurrently(view.starts, tried), strict=True))


def _worth_fitting(current: Hypothesis, looked: Starts, least: float = 0.0, some: int = 0) -> Starts:
    """Return the starts of the effects that are worth a fit, the most promising first; ``some`` in any case."""
    order = sorted(looked, key=lambda name: -looked[name][0].promise)
    least = max(least, Searching.WORTH_FITTING * looked[order[0]][0].promise if order else 0.0)
    least = max(least, _price(current))
    worth = [name for i, name in enumerate(order) if looked[name][0].promise >= least or i < some]
    equals = {name: EFFECTS[name].equivalent if current.outputs == 1 else () for name in worth}
    twins = {twin for name in worth for twin in equals[name] if precedes(name, twin)}
    worth = [name for name in worth if name not in twins][: Searching.MOST_FITS]
    if some and not current.effects:
        worth += [name for name in order if EFFECTS[name].widens] + [
            name for name in EffectPriors.COMMON if name in looked
        ]
    return {name: promising(looked[name]) for name in dict.fromkeys(worth)}


def _most_missed(fits: Fits, current: Hypothesis, names: Sequence[str]) -> list[tuple[str, ScoredStart]]:
    """Return the effects that promise most of the free run's error, as the set is tuned for that run, with a start.

    What is likely is not what a simulation lacks: a joint's wave at a tenth of a radian per second is worth thousands
    of units of likelihood next to a friction that leaves two, slowly.
    """
    fit = fits.trials.one(current).fit
    view = Screen(replace(fit, derivative=jacobian_at(fit.problem, fit.x, fit.outputs)), fits.model)
    looked = _looked(view, names, current)
    order = sorted(looked, key=lambda name: -looked[name][0].promise)[: Searching.FEWEST_FITS]
    return [(name, looked[name][0]) for name in order if looked[name][0].promise > 0.0]


def _is_elsewhere(name: str, start: ScoredStart, starts: Starts) -> bool:
    """Tell whether an effect would begin elsewhere than from other starts: none, or an event at other moments."""
    others = starts.get(name, ())
    return not others or (
        EFFECTS[name].event and all(_moments_of(start.release) != _moments_of(other.release) for other in others)
    )


def _promised_moments(looked: Starts) -> Sequence[Moments]:
    """Return the moments of the most promising event [s since the start of each recording]; none where none promises.

    What happened once in a recording is found once, and each law that may have happened is tried on it.
    """
    events = [name for name in looked if EFFECTS[name].event]
    best = max(events, key=lambda name: looked[name][0].promise, default="")
    return _moments_of(looked[best][0].release) if best and looked[best][0].promise > 0.0 else ()


def _at_moments(view: WeightedScoreTests, looked: Starts, moments: Sequence[Moments], price: float) -> Starts:
    """Return the starts of the events among some effects at moments that are known, next to those of their own."""
    if not any(begin < end for begin, end in moments):
        return {}
    handed = {name: view.handed_over(name, moments)[:1] for name in looked if EFFECTS[name].event}
    return {
        name: [*promising(looked[name]), *found] for name, found in handed.items() if found and found[0].promise > price
    }


def _may_be_best(each: Hypothesis, best: Hypothesis, current: Hypothesis) -> bool:
    """Tell whether a fit of a few steps may end as the best: near it, or an event whose moments are not found."""
    is_event = any(EFFECTS[name].event for name in each.effects - current.effects)
    return each.score <= best.score + Searching.NEARLY * _gain(best, current) or (is_event and not current.effects)


def _open(fits: Fits, current: Hypothesis) -> Sequence[str]:
    """Return the testable effects; behind a sensor blind for the sign, reversals are those of the motion."""
    if BLIND not in current.effects and BLIND not in fits.model.effects:
        return fits.names
    result = current.result
    p = np.array([result.p_of(i) for i in range(len(fits.records))])
    p[:, slot(BLIND, "share")] = 0.0
    seeing = [
        replace(record, output=simulate(result.problem.grid, record, mine, start_of(result.problem, result.x, i)))
        for i, (record, mine) in enumerate(zip(fits.records, p, strict=True))
    ]
    return list(dict.fromkeys([*fits.names, *open_hypotheses(fits.model, seeing)[0]]))


def _nearest(fits: Fits, current: Hypothesis, name: str) -> tuple[Hypothesis | None, Hypothesis, WeightedScoreTests]:
    """Fit the look-alike that explains most in an effect's place to its end; None where none comes near.

    An event's moments are handed over to the events in its place. A load that walks far has no law for a first look to
    judge it by: it is fitted to its end.
    """
    reduced = fits.without(current, name)
    view = fits.view(reduced)
    alike = [other for other in fits.names if other not in current.effects and are_alike(name, other)]
    looked = _looked(view, alike, reduced)
    least = Searching.SAME_PROMISE * view.starts(name)[0].promise if name != GRADE else 0.0
    moments = moments_of(current.result, name) if name != GRADE and EFFECTS[name].event else _promised_moments(looked)
    starts = {**_worth_fitting(reduced, looked, least), **_at_moments(view, looked, moments, _price(reduced))}
    rough = [fits.added(reduced, other, starts[other], current) for other in starts]
    near = current.score + Searching.NEARLY * _gain(current, reduced)
    found = [each for each in rough if each is not None and each.score < near]
    best = [fits.finish(min(found, key=lambda each: each.score), current)] if found else []
    best += with_free_load(fits, reduced) if GRADE in alike else []
    return min(best, key=lambda each: each.score, default=None), reduced, view


def _is_event_of_load(name: str) -> bool:
    """Tell whether an effect is one that a road's grade may be taken for: a load that comes and goes."""
    return EFFECTS[name].event and EFFECTS[name].element is Element.LOAD


def _moments_of(release: Release) -> list[Moments]:
    """Return from when to when an event acts in each recording where a fit of it would start [s since it began]."""
    each = [{unknown.name: unknown.start for unknown in own} for own in release.own]
    return [(own["from_s"], own["to_s"]) for own in each]


def _price(of: Hypothesis) -> float:
    """Return what one more unknown costs in the score (Schwarz, 1978)."""
    return float(np.log(of.result.residual.size))


def _gain(better: Hypothesis, than: Hypothesis) -> float:
    return max(than.score - better.score, 0.0)


def precedes(one: str, other: str) -> bool:
    """Tell whether an effect comes before another in the catalogue: along the chain from command to sample."""
    order = list(EFFECTS)
    return order.index(one) < order.index(other)


def are_alike(one: str, other: str) -> bool:
    """Tell whether one effect is tried in another's place: a look-alike, a neighbour, or an event for an event."""
    a, b = EFFECTS[one], EFFECTS[other]
    alike_to = {*a.resembles, *a.equivalent}, {*b.resembles, *b.equivalent}
    return other in alike_to[0] or one in alike_to[1] or a.element is b.element or (a.event and b.event)
