"""What is believed of an effect: probability over all sets that hold it, and weight in the error.

A score is minus twice a log-probability, if the model were the world. Worlds are written in other forms than the model,
and what they leave takes part in every difference of scores: these are divided by what is calibrated (``calibration``)
and by what the best set leaves that is no noise (``remainder``).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from estimator.diagnosis.hypotheses import Effects
from estimator.diagnosis.inference.likelihood import Hypothesis
from estimator.physics.catalogue import EFFECTS


@dataclass(frozen=True, slots=True)
class Belief:
    """What is believed of one effect of the best set.

    Attributes
    ----------
    probability : float
        Of this effect or one of those it can't be told from.
    share : float
        Share of the re-tuned model's squared free-run error that goes with it.
    score : float
        By which the score rises without it.
    alike : tuple of str
        Effects that explain as much in its place.
    """

    name: str
    probability: float
    share: float
    score: float
    alike: tuple[str, ...]


def beliefs(
    best: Hypothesis,
    visited: Mapping[Effects, Hypothesis],
    nothing: Hypothesis,
    tempered: float,
    alike_within: float,
    alike_share: float,
) -> tuple[Belief, ...]:
    """Return what is believed of each effect of the best set, the weightiest first.

    Parameters
    ----------
    visited : mapping of set to Hypothesis
        All that were fitted to their end, the sets without each effect of the best among them.
    tempered : float
        By which differences of scores are divided.
    alike_within : float
        Difference in score within which another effect in an effect's place is as good.
    alike_share : float
        The same over what the effect itself explains.
    """
    found = []
    for name in sorted(best.effects):
        without = visited[best.effects - {name}]
        within = max(alike_within, alike_share * (without.score - best.score))
        alike = _alike(name, best, visited, within)
        found.append(
            Belief(
                name,
                _probability({name, *alike, *_same_law(name)}, visited, tempered),
                share_of(without, best, nothing),
                without.score - best.score,
                alike,
            )
        )
    return tuple(sorted(found, key=lambda belief: -belief.share))


def share_of(without: Hypothesis, best: Hypothesis, nothing: Hypothesis) -> float:
    """Return the share of the re-tuned model's squared free-run error that goes with an effect."""
    most = max(nothing.free_squares, without.free_squares)
    return max(without.free_squares - best.free_squares, 0.0) / most


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
    equivalent = {twin for other in near for twin in EFFECTS[other].equivalent}
    return tuple(sorted((near | equivalent) - best.effects))


def _probability(names: set[str], visited: Mapping[Effects, Hypothesis], tempered: float) -> float:
    """Return the probability that one of some effects is there, over all sets that were fitted."""
    scores = np.array([each.score for each in visited.values()])
    weights = np.exp(-0.5 * (scores - scores.min()) / tempered)
    there = np.array([bool(effects & names) for effects in visited])
    return float(weights[there].sum() / weights.sum())
