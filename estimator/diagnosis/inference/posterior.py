"""What is believed of an effect: probability over all sets that hold it, and weight in the error.

A score is minus twice a log-probability, if the model were the world. Worlds are written in other forms than the model,
and what they leave takes part in every difference of scores: these are divided by what is calibrated (``calibration``)
and by what the best set leaves that is no noise (``remainder``).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from estimator.diagnosis.hypotheses import Effects
from estimator.diagnosis.inference.likelihood import Hypothesis
from estimator.diagnosis.inference.plausible import GRADE
from estimator.physics.catalogue import EFFECTS


class Score(NamedTuple):
    """The score of a set of effects, and whether its values are all a case of their effect."""

    effects: frozenset[str]
    score: float
    is_plausible: bool = True


@dataclass(frozen=True, slots=True)
class Belief:
    """What is believed of one effect of the best set.

    Attributes
    ----------
    names : frozenset of str
        The effect, those it can't be distinguished from, and those that hold it or are one of it.
    probability : float
        Of this effect or one of those it can't be distinguished from.
    share : float
        Share of the re-tuned model's squared free-run error that goes with it.
    score : float
        By which the score rises without it.
    alike : tuple of str
        Effects that explain as much in its place.
    """

    name: str
    names: frozenset[str]
    probability: float
    share: float
    score: float
    alike: tuple[str, ...]


def beliefs(
    best: Hypothesis,
    visited: Mapping[Effects, Hypothesis],
    scores: Sequence[Score],
    share: Mapping[str, float],
    tempered: float,
    alike_within: float,
    alike_share: float,
) -> tuple[Belief, ...]:
    """Return what is believed of each effect of the best set, the weightiest first.

    Parameters
    ----------
    visited : mapping of set to Hypothesis
        All that were fitted to their end, the sets without each effect of the best among them.
    scores : sequence of Score
        Of those of the same sets that a machine can be.
    share : mapping of str to float
        Of each effect of the best set (``shares``).
    tempered : float
        By which differences of scores are divided.
    alike_within : float
        Difference in score within which another effect in an effect's place is as good.
    alike_share : float
        The same over what the effect itself explains.
    """
    found = []
    plausible = {each.effects: visited[each.effects] for each in scores if each.is_plausible}
    for name in sorted(best.effects):
        without = visited[best.effects - {name}]
        within = max(alike_within, alike_share * (without.score - best.score))
        alike = _alike(name, best, plausible, within)
        names = frozenset({name, *alike, *_same_law(name)})
        found.append(
            Belief(
                name,
                names,
                probability_of(names, scores, tempered),
                min(max(share[name], 0.0), 1.0),
                without.score - best.score,
                alike,
            )
        )
    return tuple(sorted(found, key=lambda belief: -belief.share))


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
    """Return the share of the re-tuned model's squared free-run error that goes with each effect of the last set.

    Along the way from the nominal model to the best set, each effect has what is left less from where it was added. One
    that takes another's place has its share, too; what a step without a new effect changes all have in proportion.
    Together they are what the last set explains.
    """
    found: dict[str, float] = {}
    left = levels(path)
    for (one, before), (other, after) in pairwise(zip(path, left, strict=True)):
        gone = sum(found.pop(name) for name in one.effects - other.effects)
        change, new = (before - after) / left[0] + gone, other.effects - one.effects
        among = new or other.effects
        whole = sum(found.values())
        for name in among:
            part = 1.0 / len(among) if new or whole <= 0.0 else found[name] / whole
            found[name] = found.get(name, 0.0) + part * change
    return found


def shares_with_grade(best: Hypothesis, visited: Mapping[Effects, Hypothesis], nothing: Hypothesis) -> dict[str, float]:
    """Return the same of a set in which the load walks far, which follows whatever is slow.

    What another effect has is by how much more is left without it; the rest goes with the grade.
    """
    without = {name: visited[best.effects - {name}] for name in best.effects if name != GRADE}
    found = {name: max(fall(each, best, nothing), 0.0) for name, each in without.items()}
    return found | {GRADE: max(1.0 - best.free_squares / nothing.free_squares - sum(found.values()), 0.0)}


def _same_law(name: str) -> set[str]:
    """Return the effects that hold this one as a special case, or are one of it."""
    return {*EFFECTS[name].contains, *(other for other, entry in EFFECTS.items() if name in entry.contains)}


def free_rms(hypothesis: Hypothesis) -> float:
    """Return the RMS of the free-run error, re-tuned to leave least of it."""
    return math.sqrt(hypothesis.free_squares / hypothesis.plain.residual.size)


def _alike(name: str, best: Hypothesis, visited: Mapping[Effects, Hypothesis], within: float) -> tuple[str, ...]:
    others = best.effects - {name}
    exchanged = {
        next(iter(effects - others)): each
        for effects, each in visited.items()
        if len(effects - others) == 1 and others <= effects
    }
    near = {name, *(other for other, each in exchanged.items() if each.score - best.score < within)}
    equivalent = {twin for other in near for twin in EFFECTS[other].equivalent if best.outputs == 1}
    return tuple(sorted((near | equivalent) - best.effects))


def probability_of(names: Collection[str], scores: Sequence[Score], tempered: float) -> float:
    """Return the probability that one of some effects is there, over all sets that were fitted.

    A set with values that are no case of its effects is evidence of something else: against the effects it does
    without, and for none that it holds.

    Parameters
    ----------
    tempered : float
        By which differences of scores are divided.
    """
    holds = [any(name in names for name in each.effects) for each in scores]
    counted = [(each.score, has) for each, has in zip(scores, holds, strict=True) if each.is_plausible or not has]
    values = np.array([score for score, _ in counted])
    weights = np.exp(-0.5 * (values - values.min()) / tempered)
    there = np.array([has for _, has in counted])
    return float(weights[there].sum() / weights.sum())
