"""A law without a name as a hypothesis: found by regression on innovations, scored as every other.

Around a set of effects the best law of each element is looked for on columns that the hypothesis' own filter has
whitened (``estimator.diagnosis.unnamed``), the law in the simulation; then the disturbances are estimated anew. It pays
as an effect does: each coefficient is an unknown, and each term was chosen among so many forms, at one of so many
elements.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.inference.calibration import (
    LEAST_PROBABILITY,
    LEAST_SHARE,
    MOST_AT_PLACE,
    MOST_ELSEWHERE,
    TEMPERED,
)
from estimator.diagnosis.inference.disturbances import estimated, reading_noise
from estimator.diagnosis.inference.likelihood import ROUNDS, Hypothesis, of_first_outputs
from estimator.diagnosis.inference.posterior import Belief, free_rms
from estimator.diagnosis.inference.search import Search
from estimator.diagnosis.inference.verdict import Decision, tempered_by
from estimator.diagnosis.result import Verdict
from estimator.diagnosis.unnamed import Hunt, hunts_of, scene
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.jacobian import changes
from estimator.physics.problem import outputs_at, own_part

LOOKING_ROUNDS = 6
"""Rounds of the search for a law without a name, at most."""


@dataclass(frozen=True, slots=True)
class Law:
    """The law without a name that makes the recordings most probable together with a set of effects.

    Attributes
    ----------
    element : Element
    terms : tuple of (str, float)
        Functions of what happens in the line, each with its coefficient.
    score : float
        That of the hypothesis with the law (``likelihood``).
    rms : float
        RMS of the free-run error with it [unit of the output].
    """

    element: Element
    terms: tuple[tuple[str, float], ...]
    score: float
    rms: float


def hunts_around(hypothesis: Hypothesis) -> list[Hunt]:
    """Look for the best law to add to a hypothesis at every element; none inside a plant simulated elsewhere."""
    if hypothesis.plain.problem.grid.plant is not None:
        return []
    noise = float(reading_noise(hypothesis.sizes)[0])
    return hunts_of(scene(hypothesis.plain, noise, hypothesis.filter), LOOKING_ROUNDS)


def best_law(hypothesis: Hypothesis, hunts: Sequence[Hunt]) -> Law | None:
    """Return the law with which the recordings are most probable; None where they are more probable without one."""
    white = hypothesis.filter(hypothesis.plain.residual)
    before = float(white @ white) / white.size
    laws = [_scored(hypothesis, hunt, before, math.log(len(hunts))) for hunt in hunts if hunt.law.terms]
    best = min(laws, key=lambda law: law.score, default=None)
    return best if best is not None and best.score < hypothesis.score else None


def _scored(hypothesis: Hypothesis, hunt: Hunt, before: float, places: float) -> Law:
    """Return a law with its score: that of its innovations, or with disturbances estimated anew where it is simulated.

    With all disturbances in one proportion minus twice the log-likelihood falls by ``n log(Q / Q')``, Q the squared
    innovations; estimated anew it falls further.
    """
    n = hypothesis.plain.residual.size
    score = hypothesis.score - hunt.law.information(before, hunt.mean_square, n) + 2.0 * places
    is_simulated = any(weights.any() for weights in hunt.weights)
    if is_simulated:
        paid = hunt.law.coefficients * math.log(n) + 2.0 * (hunt.law.choices + places)
        own = hypothesis.score - hypothesis.minus_twice_log
        score = min(score, _minus_twice_log(hypothesis, hunt) + own + paid)
    return Law(hunt.element, hunt.law.terms, score, _rms(hunt))


def _minus_twice_log(hypothesis: Hypothesis, hunt: Hunt) -> float:
    result = hunt.view.result
    error = np.concatenate(
        [
            (out - record.output)[use]
            for out, record, use in zip(result.outputs, result.problem.records, result.problem.use, strict=True)
        ]
    )
    return estimated(result, error, hypothesis.sizes, hypothesis.limits, ROUNDS)[1]


def _rms(hunt: Hunt) -> float:
    """Return the RMS of the error with a law, each recording's load torque and initial state as they leave least."""
    result = hunt.view.result
    problem, without = result.problem, outputs_at(result.problem, result.x)
    left = count = 0.0
    for i, (record, use, out) in enumerate(zip(problem.records, problem.use, result.outputs, strict=True)):
        first = own_part(problem, i).start
        columns = np.arange(first, first + problem.local[i].own_rows.start)
        start = np.linalg.qr(changes(problem, result.x, i, columns, without))[0]
        error = (out - record.output)[use]
        left += float(error @ error) - float(np.sum((start.T @ error) ** 2))
        count += error.size
    return math.sqrt(max(left, 0.0) / count)


def at_place(search: Search, decision: Decision, element: Element) -> Hypothesis:
    """Return the best set without the effects that act elsewhere or are doubted; of the first output."""
    best = decision.best
    here = {each.name for each in (*decision.named, *decision.traces) if element in _elements(each)}
    for name in sorted(best.effects - here):
        best = search.without(best, name)
    return of_first_outputs(best)


def acts_at(beliefs: Sequence[Belief], element: Element) -> bool:
    """Tell whether one of some effects acts at an element, or one that it can't be distinguished from."""
    return any(element in _elements(each) for each in beliefs)


def gain_of_names(alone: Hypothesis, nothing: Hypothesis, law: Law) -> float:
    """Return what a set of names gains over nothing, as a share of what a law without a name gains.

    ``alone`` is that set: the best one, or what of it acts at the law's place.
    """
    return (nothing.score - alone.score) / (nothing.score - law.score)


def weighed_against(decision: Decision, law: Law | None, alone: Callable[[Element], Hypothesis]) -> Decision:
    """Return a decision in which a law without a name has its share of the probability.

    ``law`` is the best without any effect; ``alone`` returns the best set without what acts elsewhere. In as far
    as the law makes the recordings more probable than the best set of names, what these explain is there, and they are
    not, unless they gain nearly as much. At its own place a law without a name is a name's law in another form, where
    the names there gain most of what it gains. One that leaves the free-run error as it was is a trace, and no other
    explanation of what the names explain. Laws without a name are sought in the first output alone, and weighed by what
    it says.
    """
    best, nothing = of_first_outputs(decision.best), of_first_outputs(decision.nothing)
    if law is None or law.score >= nothing.score or 1.0 - (law.rms / free_rms(nothing)) ** 2 < LEAST_SHARE:
        return decision
    if gain_of_names(best, nothing, law) >= MOST_ELSEWHERE:
        return decision
    same = acts_at(decision.named, law.element) and gain_of_names(alone(law.element), nothing, law) >= MOST_AT_PLACE
    first = replace(decision, best=best, nothing=nothing)
    weighed = against_rival(first, law.score, lambda each: not (same and law.element in _elements(each)))
    return replace(weighed, best=decision.best, nothing=decision.nothing)


def against_rival(decision: Decision, score: float, falls: Callable[[Belief], bool]) -> Decision:
    """Return a decision in which a hypothesis of a score, without names, has its share of the probability.

    ``falls`` tells which names it stands against. Those left with too little are doubted.
    """
    share = _share_of_names(decision, score)
    weighed = [replace(each, probability=each.probability * share) if falls(each) else each for each in decision.named]
    named = tuple(each for each in weighed if each.probability >= LEAST_PROBABILITY)
    doubted = tuple(each for each in weighed if each not in named)
    verdict = Verdict.UNEXPLAINED if doubted and not named else decision.verdict
    return replace(decision, verdict=verdict, named=named, doubted=(*doubted, *decision.doubted))


def _share_of_names(decision: Decision, score: float) -> float:
    """Return the probability of the best set of names, of the two.

    A law of size zero is no law, and values at their bounds are the nominal line: what a rival has of the probability
    is what it has beyond the nominal model, which has had its share of the posterior already.
    """
    best = decision.best
    tempered = tempered_by(decision.failed, best.plain.residual.size, TEMPERED)
    rival, nominal = (
        math.exp(min(0.5 * (decision.best.score - each) / tempered, 700.0)) for each in (score, decision.nothing.score)
    )
    return 1.0 / (1.0 + max(rival - nominal, 0.0))


def _elements(belief: Belief) -> set[Element]:
    """Return where an effect acts, or one that it can't be distinguished from."""
    return {EFFECTS[name].element for name in (belief.name, *belief.alike)}
