"""A law without a name as a hypothesis: found by regression on innovations, scored as every other.

Around a set of effects the best law of each element is looked for on columns that the hypothesis' own filter has
whitened (``estimator.diagnosis.unnamed``), the law in the simulation; then the disturbances are estimated anew. It pays
as an effect does: each coefficient is an unknown, and each term was chosen among so many forms, at one of so many
elements.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.diagnosis.hypotheses import NOTHING
from estimator.diagnosis.inference.calibration import LEAST_SHARE
from estimator.diagnosis.inference.disturbances import estimated, reading_noise
from estimator.diagnosis.inference.judge import Grounds, Score, free_rms
from estimator.diagnosis.inference.likelihood import ROUNDS, Hypothesis, of_first_outputs
from estimator.diagnosis.unnamed import Hunt, hunts_of, scene
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


def rival_laws(ground: Grounds, alone: Law | None, beside: Law | None) -> tuple[Score, ...]:
    """Return laws without a name as hypotheses: one instead of all effects, and one beside the best set of these.

    Where the law alone is more probable than names and a law for what they leave, the names imitate it. Laws are sought
    in the first output alone: what they gain over the same set without them counts there. One that leaves the free-run
    error as it was is a trace, and no other explanation of what the names explain.
    """
    best, first = of_first_outputs(ground.best), of_first_outputs(ground.nothing)
    offset = ground.best.score - best.score
    found = []
    if alone is not None and 1.0 - (alone.rms / free_rms(first)) ** 2 >= LEAST_SHARE:
        found.append(Score(NOTHING, offset + alone.score))
    if beside is not None and best.effects:
        found.append(Score(best.effects, offset + beside.score))
    return tuple(found)
