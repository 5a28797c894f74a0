"""The decision: which effects are named, which are traces, and what the rest is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.diagnosis.inference.calibration import (
    ALIKE_SHARE,
    ALIKE_WITHIN,
    CLEARLY_BELOW,
    LEAST_PROBABILITY,
    LEAST_SHARE,
    TEMPERED,
)
from estimator.diagnosis.inference.disturbances import reading_noise
from estimator.diagnosis.inference.likelihood import Hypothesis
from estimator.diagnosis.inference.plausible import GRADE
from estimator.diagnosis.inference.posterior import (
    Belief,
    Score,
    beliefs,
    fall,
    free_rms,
    levels,
    shares,
    shares_with_grade,
)
from estimator.diagnosis.inference.remainder import Test, tests
from estimator.diagnosis.inference.search import Search
from estimator.diagnosis.result import Verdict
from estimator.physics.catalogue import EFFECTS
from estimator.physics.problem import Problem


@dataclass(frozen=True, slots=True)
class Decision:
    """A verdict and what it rests on.

    Attributes
    ----------
    named, traces : tuple of Belief
        Effects that are established, the weightiest first; those among them that hardly move the error.
    doubted : tuple of Belief
        Effects of the best set that are not established.
    failed : tuple of Test
        What the best set leaves that noise has not.
    left : float
        Share of the re-tuned model's squared error that is left beyond the reading's noise.
    times_noise : float
        RMS of what is left over the reading's noise.
    """

    verdict: Verdict
    best: Hypothesis
    nothing: Hypothesis
    named: tuple[Belief, ...]
    traces: tuple[Belief, ...]
    doubted: tuple[Belief, ...]
    failed: tuple[Test, ...]
    left: float
    times_noise: float


@dataclass(frozen=True, slots=True)
class Grounds:
    """What a decision rests on, before any threshold is applied.

    Attributes
    ----------
    best, nothing : Hypothesis
        The best set of effects, and the re-tuned model.
    beliefs : tuple of Belief
        Of every effect of the best set that is large enough to be distinguished from another way of sampling.
    tests : tuple of Test
    scores : tuple of Score
        Of all sets that were fitted to their end and that a machine can be.
    """

    best: Hypothesis
    nothing: Hypothesis
    beliefs: tuple[Belief, ...]
    tests: tuple[Test, ...]
    scores: tuple[Score, ...]


def tempered_by(tests: Sequence[Test], samples: int, factor: float) -> float:
    """Return by which differences of scores are divided: more where a test finds information that no law has used.

    That is what it finds beyond what is left in worlds of which all is explained. Tests find the same information
    again: the one that finds most of it says how much there is at least.
    """
    beyond = [test.value - test.most for test in tests if test.failed and test.is_share]
    return factor + samples * max(beyond, default=0.0)


def grounds(search: Search) -> Grounds:
    """Search, and return what there is to decide on."""
    nothing = search.nothing()
    best = _as_simple_as_will_do(search, search.run())
    for name in best.effects:
        search.without(best, name)
    examined = tests(best)
    tempered = tempered_by(examined, best.plain.residual.size, TEMPERED)
    graded = GRADE in best.effects
    share = shares_with_grade(best, search.visited, nothing) if graded else shares(search.path)
    scores = search.scores
    found = beliefs(best, search.visited, scores, share, tempered, ALIKE_WITHIN, ALIKE_SHARE)
    resolved = tuple(each for each in found if search.is_resolved(best, each.name))
    return Grounds(best, nothing, resolved, examined, scores)


def decide(search: Search, ground: Grounds, with_findings: bool = False) -> Decision:
    """Decide on grounds; ``with_findings`` where faults of the acquisition were recognised and compensated."""
    best, nothing = ground.best, ground.nothing
    failed = tuple(test for test in ground.tests if test.failed)
    established = [each for each in ground.beliefs if each.probability >= LEAST_PROBABILITY]
    named = tuple(each for each in established if each.share >= LEAST_SHARE)
    noise = float(reading_noise(best.sizes)[0])
    rms = math.sqrt(levels(search.path)[-1] / best.plain.residual.size)
    left = min(max(rms**2 - noise**2, 0.0) / free_rms(nothing) ** 2, 1.0)
    return Decision(
        verdict_of(rms / spread(best.plain.problem), bool(named) or with_findings, bool(failed)),
        best,
        nothing,
        named,
        tuple(each for each in established if each not in named),
        tuple(each for each in ground.beliefs if each.probability < LEAST_PROBABILITY),
        failed,
        left,
        rms / noise,
    )


def _as_simple_as_will_do(search: Search, best: Hypothesis) -> Hypothesis:
    """Return the best set with special cases in the place of general laws that hardly change the error further.

    What a general law has beyond its special case would be a trace.
    """
    for name in sorted(best.effects):
        for special in EFFECTS[name].contains:
            simpler = search.exchanged(best, name, special)
            if simpler is None:
                continue
            if fall(simpler, best, search.nothing()) < LEAST_SHARE:
                best = simpler
                search.path.append(best)
                break
    return best


def verdict_of(of_spread: float, is_named: bool, is_more_than_noise: bool) -> Verdict:
    """Return the verdict on a set that leaves an error of so much of the signal's spread (CONTRACT)."""
    if of_spread > CLEARLY_BELOW:
        return Verdict.UNEXPLAINED
    if is_named:
        return Verdict.PARTLY_EXPLAINED if is_more_than_noise else Verdict.EXPLAINED
    return Verdict.UNEXPLAINED if is_more_than_noise else Verdict.NO_MISMATCH


def spread(problem: Problem) -> float:
    """Return how far the output itself is spread, each recording around its mean."""
    parts = [record.output[use] for record, use in zip(problem.records, problem.use, strict=True)]
    return float(np.std(np.concatenate([part - part.mean() for part in parts])))
