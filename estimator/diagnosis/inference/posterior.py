"""What is believed of an effect: probability over all sets that hold it, and weight in the error.

A score is minus twice a log-probability, if the model were the world. Worlds are written in other forms than the model,
and what they leave takes part in every difference of scores: these count ``1 / TEMPERED``, calibrated so that of the
effects given 0.9 to 1 as many are there (``calibration.toml``).
"""

from __future__ import annotations

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
    best: Hypothesis, visited: Mapping[Effects, Hypothesis], nothing: Hypothesis, tempered: float, alike_within: float
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
    """
    found = []
    for name in sorted(best.effects):
        alike = _alike(name, best, visited, alike_within)
        without = visited[best.effects - {name}]
        found.append(
            Belief(
                name,
                _probability({name, *alike}, visited, tempered),
                (without.plain.squares - best.plain.squares) / nothing.plain.squares,
                without.score - best.score,
                alike,
            )
        )
    return tuple(sorted(found, key=lambda belief: -belief.share))


def _alike(
    name: str, best: Hypothesis, visited: Mapping[Effects, Hypothesis], within: float
) -> tuple[str, ...]:
    others = best.effects - {name}
    exchanged = {
        next(iter(effects - others)): each
        for effects, each in visited.items()
        if len(effects - others) == 1 and others <= effects
    }
    near = {other for other, each in exchanged.items() if each.score - best.score < within}
    return tuple(sorted((near | set(EFFECTS[name].equivalent)) - best.effects))


def _probability(names: set[str], visited: Mapping[Effects, Hypothesis], tempered: float) -> float:
    """Return the probability that one of some effects is there, over all sets that were fitted."""
    scores = np.array([each.score for each in visited.values()])
    weights = np.exp(-0.5 * (scores - scores.min()) / tempered)
    there = np.array([bool(effects & names) for effects in visited])
    return float(weights[there].sum() / weights.sum())
