"""Laws without a name: what the re-tuned model lacks, and what the names leave."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.diagnosis.inference.decide import Judged
from estimator.diagnosis.inference.disturbances import estimated, reading_noise
from estimator.diagnosis.inference.hypotheses import ROUNDS, Hypothesis, of_first_outputs
from estimator.diagnosis.unnamed.scene import scene
from estimator.diagnosis.unnamed.search import ElementSearch, searches_at
from estimator.physics.effect import Element
from estimator.physics.jacobian import changes
from estimator.physics.problem import outputs_at, own_part

LOOKING_ROUNDS = 6  # rounds of the search for a law without a name, at most


@dataclass(frozen=True, slots=True)
class Law:
    """The law without a name that makes the recordings most probable together with a set of effects."""

    element: Element
    terms: tuple[tuple[str, float], ...]  # functions of what happens in the line, each with its coefficient
    score: float  # that of the hypothesis with the law (``likelihood``)
    rms: float  # RMS of the free-run error with it [unit of the output]


def searches_around(hypothesis: Hypothesis) -> list[ElementSearch]:
    """Look for the best law to add to a hypothesis at every element; none inside a plant simulated elsewhere."""
    if hypothesis.result.problem.grid.plant is not None:
        return []
    noise = float(reading_noise(hypothesis.sizes)[0])
    return searches_at(scene(hypothesis.result, noise, hypothesis.filter), LOOKING_ROUNDS)


def best_law(hypothesis: Hypothesis, searches: Sequence[ElementSearch]) -> Law | None:
    """Return the law with which the recordings are most probable; None where they are more probable without one."""
    white = hypothesis.filter(hypothesis.result.residual)
    before = float(white @ white) / white.size
    laws = [_scored(hypothesis, search, before, math.log(len(searches))) for search in searches if search.law.terms]
    best = min(laws, key=lambda law: law.score, default=None)
    return best if best is not None and best.score < hypothesis.score else None


def _scored(hypothesis: Hypothesis, search: ElementSearch, before: float, places: float) -> Law:
    """Return a law with its score: that of its innovations, or with disturbances estimated anew."""
    n = hypothesis.result.residual.size
    score = hypothesis.score - search.law.information(before, search.mean_square, n) + 2.0 * places
    is_simulated = any(weights.any() for weights in search.weights)
    if is_simulated:
        paid = search.law.coefficients * math.log(n) + 2.0 * (search.law.choices + places)
        own = hypothesis.score - hypothesis.minus_twice_log
        score = min(score, _minus_twice_log(hypothesis, search) + own + paid)
    return Law(search.element, search.law.terms, score, _rms(search))


def _minus_twice_log(hypothesis: Hypothesis, search: ElementSearch) -> float:
    result = search.view.result
    error = np.concatenate(
        [
            (out - record.output)[use]
            for out, record, use in zip(result.outputs, result.problem.records, result.problem.use, strict=True)
        ]
    )
    return estimated(result, error, hypothesis.sizes, hypothesis.limits, ROUNDS)[1]


def _rms(search: ElementSearch) -> float:
    """Return the RMS of the error with a law, each recording's load torque and initial state as they leave least."""
    result = search.view.result
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


@dataclass(frozen=True, slots=True)
class Laws:
    """Laws without a name around a decision."""

    alone: Law | None = None  # the best one next to the re-tuned model
    left: Law | None = None  # the best one for what is left
    searches: Sequence[ElementSearch] = ()  # for the one alone, element by element


def laws_around(judged: Judged) -> Laws:
    """Look for a law where something is left, or was."""
    if not judged.failed and not judged.named:
        return Laws()
    nothing, believed = of_first_outputs(judged.nothing.hypothesis), of_first_outputs(judged.believed.hypothesis)
    searches = searches_around(nothing)
    alone = best_law(nothing, searches)
    if judged.believed is judged.nothing or not judged.failed:
        return Laws(alone, alone if judged.failed else None, searches)
    return Laws(alone, best_law(believed, searches_around(believed)), searches)
