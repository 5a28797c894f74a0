"""The judge: from the sets of effects that were fitted to what is believed, and nothing after that."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from estimator.diagnosis.assemble import Z95
from estimator.diagnosis.inference.checks import (
    ALIKE_SHARE,
    ALIKE_WITHIN,
    CLEARLY_BELOW,
    GRADE,
    LEAST_PROBABILITY,
    LEAST_SHARE,
    TEMPERED,
    Test,
    is_possible,
    tests,
)
from estimator.diagnosis.inference.hypotheses import Effects, Hypothesis, covariance
from estimator.diagnosis.inference.search import Search
from estimator.diagnosis.result import Fit, Verdict
from estimator.physics.catalogue import EFFECTS
from estimator.physics.problem import Problem


class Score(NamedTuple):
    """The score of a set of effects, and whether its values are all a case of their effect."""

    effects: frozenset[str]
    score: float
    is_plausible: bool = True


@dataclass(frozen=True, slots=True)
class Belief:
    """What is believed of one effect of the best set."""

    name: str
    names: frozenset[str]
    probability: float  # of this effect or one of those it can't be distinguished from
    share: float  # share of the re-tuned model's squared free-run error that goes with it
    score: float  # by which the score rises without it
    alike: Mapping[str, Mapping[str, float]]  # effects that explain as much in its place, with their values there
    objection: str = ""

    @property
    def reason(self) -> str:
        """Why it is not named."""
        return self.objection or f"in the most probable set, but its own probability is {self.probability:.2f} only"


def fall(one: Hypothesis, other: Hypothesis, nothing: Hypothesis) -> float:
    """Return by how much less another set leaves than one, as a share of the re-tuned model's squared error."""
    return (one.free_squares - other.free_squares) / nothing.free_squares


def levels(path: Sequence[Hypothesis]) -> list[float]:
    """Return the squared free-run error that each set on a way leaves: no more than a set that it holds."""
    found: list[float] = []
    for each in path:
        held = [level for level, other in zip(found, path, strict=False) if other.effects <= each.effects]
        found.append(min(each.free_squares, *held) if held else each.free_squares)
    return found


def shares(path: Sequence[Hypothesis]) -> dict[str, float]:
    """Return the share of the re-tuned model's squared free-run error that goes with each effect of the last set."""
    found: dict[str, float] = {}
    left = levels(path)
    for (one, before), (other, after) in pairwise(zip(path, left, strict=True)):
        gone = sum(found.pop(name) for name in one.effects - other.effects)
        change, new = (before - after) / left[0] + gone, other.effects - one.effects
        among = sorted(new or other.effects)
        whole = sum(found.values())
        for name in among:
            part = 1.0 / len(among) if new or whole <= 0.0 else found[name] / whole
            found[name] = found.get(name, 0.0) + part * change
    return found


def shares_with_grade(best: Hypothesis, visited: Mapping[Effects, Hypothesis], nothing: Hypothesis) -> dict[str, float]:
    """Return the same of a set in which the load walks far, which follows whatever is slow."""
    without = {name: visited[best.effects - {name}] for name in sorted(best.effects) if name != GRADE}
    found = {name: max(fall(each, best, nothing), 0.0) for name, each in without.items()}
    return found | {GRADE: max(1.0 - best.free_squares / nothing.free_squares - sum(found.values()), 0.0)}


def _same_law(name: str) -> set[str]:
    """Return the effects that hold this one as a special case, or are one of it."""
    return {*EFFECTS[name].contains, *(other for other, entry in EFFECTS.items() if name in entry.contains)}


def free_rms(hypothesis: Hypothesis) -> float:
    """Return the RMS of the free-run error, re-tuned to leave least of it."""
    return math.sqrt(hypothesis.free_squares / hypothesis.result.residual.size)


def _alike(
    name: str, best: Hypothesis, visited: Mapping[Effects, Hypothesis], within: float
) -> dict[str, Mapping[str, float]]:
    others = best.effects - {name}
    exchanged = {
        next(iter(effects - others)): each
        for effects, each in visited.items()
        if len(effects - others) == 1 and others <= effects
    }
    near = {name: best} | {other: each for other, each in exchanged.items() if each.score - best.score < within}
    values = {other: each.result.values_of(other) for other, each in near.items()}
    for other in list(near):
        for twin in EFFECTS[other].equivalent if best.outputs == 1 else ():
            values.setdefault(twin, values[other])  # the same linear system: the same parameters
    return {other: values[other] for other in sorted({*values} - best.effects)}


def probability_of(names: Collection[str], scores: Sequence[Score], tempered: float) -> float:
    """Return the probability that one of some effects is there, over all sets that were fitted.

    A set with values that are no case of its effects is evidence of something else: against the effects it does
    without, and for none that it holds.
    """
    holds = [any(name in names for name in each.effects) for each in scores]
    counted = [(each.score, has) for each, has in zip(scores, holds, strict=True) if each.is_plausible or not has]
    values = np.array([score for score, _ in counted])
    weights = np.exp(-0.5 * (values - values.min()) / tempered)
    there = np.array([has for _, has in counted])
    return float(weights[there].sum() / weights.sum())


@dataclass(frozen=True, slots=True)
class Grounds:
    """What a decision rests on, before any threshold is applied."""

    best: Hypothesis  # the best set of effects, and the re-tuned model
    nothing: Hypothesis
    shares: Mapping[str, float]  # of each effect of the best set (``shares``)
    tests: tuple[Test, ...]
    scores: tuple[Score, ...]  # of all sets that were fitted to their end and that a machine can be
    beliefs: tuple[Belief, ...] = ()


@dataclass(frozen=True, slots=True)
class Decision:
    """What is believed."""

    best: Hypothesis
    nothing: Hypothesis
    named: tuple[Belief, ...]  # effects that are established, the weightiest first
    traces: tuple[Belief, ...]
    doubted: tuple[Belief, ...]  # effects of the best set that are not established
    failed: tuple[Test, ...]  # what the best set leaves that noise has not


def tempered_by(tests: Sequence[Test], samples: int, factor: float) -> float:
    """Return by which differences of scores are divided: more where a test finds information that no law has used."""
    beyond = [test.value - test.most for test in tests if test.failed and test.is_share]
    return factor + samples * max(beyond, default=0.0)


def grounds(search: Search) -> Grounds:
    nothing = search.nothing()
    best = _with_sizes(search, _as_simple_as_will_do(search, search.run()))
    for name in best.effects:
        search.without(best, name)
    search.fit_look_alikes(best)
    share = shares_with_grade(best, search.visited, nothing) if GRADE in best.effects else shares(search.path)
    ground = Grounds(best, nothing, share, tests(best), scores_of(search))
    return replace(ground, beliefs=believed(search, ground))


def scores_of(search: Search) -> tuple[Score, ...]:
    """Return the scores of all sets that were fitted to their end and that a machine can be, in a fixed order."""
    possible = [each for each in search.visited.values() if is_possible(each, search.records)]
    ordered = sorted(possible, key=lambda each: sorted(each.effects))
    return tuple(Score(each.effects, each.score, search.is_plausible(each)) for each in ordered)


def believed(search: Search, ground: Grounds, rivals: Sequence[Score] = ()) -> tuple[Belief, ...]:
    """Return what is believed of each effect of the best set, the weightiest first.

    Over all sets that were fitted and ``rivals`` beyond these.
    """
    best, scores = ground.best, (*ground.scores, *rivals)
    tempered = tempered_by(ground.tests, best.result.residual.size, TEMPERED)
    as_good = max(ALIKE_WITHIN, 2.0 * tempered * math.log(1.0 / (1.0 - LEAST_PROBABILITY)))
    plausible = {each.effects: search.visited[each.effects] for each in scores if each.is_plausible}
    found = []
    for name in sorted(best.effects):
        gained = search.visited[best.effects - {name}].score - best.score
        alike = _alike(name, best, plausible, max(as_good, ALIKE_SHARE * gained))
        names = frozenset({name, *alike, *_same_law(name)})
        share = min(max(ground.shares[name], 0.0), 1.0)
        found.append(Belief(name, names, probability_of(names, scores, tempered), share, gained, alike))
    found.sort(key=lambda belief: -belief.share)
    return tuple(each for each in found if search.is_resolved(best, each.name))


def decide(search: Search, ground: Grounds, rivals: Sequence[Score] = ()) -> Decision:
    """Decide which effects of the best set are there, against all sets without them and ``rivals``."""
    found = believed(search, ground, rivals) if rivals else ground.beliefs
    established = [each for each in found if each.probability >= LEAST_PROBABILITY]
    named = tuple(each for each in established if each.share >= LEAST_SHARE)
    return Decision(
        ground.best,
        ground.nothing,
        named,
        tuple(each for each in established if each not in named),
        tuple(each for each in found if each.probability < LEAST_PROBABILITY),
        tuple(test for test in ground.tests if test.failed),
    )


def _as_simple_as_will_do(search: Search, best: Hypothesis) -> Hypothesis:
    """Return the best set with special cases in the place of general laws that hardly change the error further.

    What a general law has beyond its special case would be a trace, or nothing at all.
    """
    for name in sorted(best.effects):
        for special in EFFECTS[name].contains:
            simpler = search.exchanged(best, name, special)
            if simpler is None:
                continue
            if holds_null(best, name) or fall(simpler, best, search.nothing()) < LEAST_SHARE:
                best = simpler
                search.path.append(best)
                break
    return best


def _with_sizes(search: Search, best: Hypothesis) -> Hypothesis:
    for name in sorted(best.effects):
        without = search.without(best, name)
        if without.score <= best.score or holds_null(best, name):
            best = without
            search.path.append(best)
    return best


def holds_null(hypothesis: Hypothesis, name: str) -> bool:
    """Tell whether the 95 % interval of an effect's size holds the value at which the effect does nothing.

    The size is its first parameter; where that may be left out, each that was fitted and does nothing at 0 or infinity.
    """
    entry = EFFECTS[name]
    if entry.profile:
        return False
    first, result = entry.parameters[0], hypothesis.result
    among = {p.name: p.null for p in entry.shared_parameters if p is first or (first.optional and p.optional)}
    spread, pinned = np.sqrt(np.maximum(np.diag(covariance(hypothesis)), 0.0)), result.pinned
    held = []
    for i, each in enumerate(result.problem.shared):
        null = among.get(each.name) if each.effect == name and each.low < each.high else None
        if null is None or (first.optional and null not in (0.0, math.inf, first.null)):
            continue
        if math.isinf(null):
            held.append(bool(pinned[i]) and result.x[i] > 0.5 * each.high)
        else:
            held.append(abs(result.x[i] - null / each.scale) <= Z95 * spread[i])
    return bool(held) and all(held)


def verdict_of(of_spread: float, is_named: bool, is_more_than_noise: bool, falls: bool = True) -> Verdict:
    """Return the verdict on a set that leaves an error of so much of the signal's spread (CONTRACT)."""
    if is_named and (of_spread > CLEARLY_BELOW or not falls):
        return Verdict.UNEXPLAINED
    if is_named:
        return Verdict.PARTLY_EXPLAINED if is_more_than_noise else Verdict.EXPLAINED
    return Verdict.UNEXPLAINED if is_more_than_noise or of_spread > CLEARLY_BELOW else Verdict.NO_MISMATCH


def error_falls(fit: Fit) -> bool:
    """Tell whether the augmented model's error is below the re-tuned model's, also on data not used for the fit."""
    return fit.augmented < fit.retuned and fit.holdout_augmented < fit.holdout_retuned


def spread(problem: Problem) -> float:
    parts = [record.output[use] for record, use in zip(problem.records, problem.use, strict=True)]
    return float(np.std(np.concatenate([part - part.mean() for part in parts])))
