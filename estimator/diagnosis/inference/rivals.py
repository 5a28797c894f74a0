"""Rivals of the names: a law without a name, and nominal values off their data sheet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.inference.checks import LEAST_SHARE, tests
from estimator.diagnosis.inference.disturbances import MOST_FORM, estimated, reading_noise
from estimator.diagnosis.inference.hypotheses import (
    NOTHING,
    ROUNDS,
    Effects,
    Hypothesis,
    choices_of,
    covariance,
    fitted,
    of_first_outputs,
)
from estimator.diagnosis.inference.judge import Grounds, Score, free_rms
from estimator.diagnosis.inference.search import Search
from estimator.diagnosis.result import OffNominal
from estimator.diagnosis.unnamed.scene import scene
from estimator.diagnosis.unnamed.search import ElementSearch, searches_at
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.fit import not_fitted
from estimator.physics.jacobian import changes
from estimator.physics.model import parameter_unit
from estimator.physics.problem import outputs_at, own_part

FREELY = 3.0
"""Factor, either way, within which a nominal parameter is looked for: beyond it a value is no slip of a data sheet, and
the integration's steps, chosen for the nominal line, would not follow."""

CLEARLY = 3.0  # standard errors by which a value must lie beyond what it is trusted to


@dataclass(frozen=True, slots=True)
class FreeLine:
    """The nominal line with its values free."""

    score: float  # that of a hypothesis (``likelihood``)
    leaves_noise: bool  # whether what it leaves passes for noise
    off_nominal: tuple[OffNominal, ...]  # what clearly left its tolerance, the clearest first


def free_line(search: Search) -> FreeLine | None:
    """Fit the nominal line beyond its tolerances; None where these hold nothing back."""
    nothing = search.nothing().result
    shared = nothing.problem.shared
    trusted = [not s.effect and np.isfinite(s.low) and s.low < s.high for s in shared]
    if not any(free and at_bound for free, at_bound in zip(trusted, nothing.pinned, strict=False)):
        return None
    freed = tuple(
        replace(s, low=min(s.low, 1.0 / FREELY), high=max(s.high, FREELY)) if free else s
        for s, free in zip(shared, trusted, strict=True)
    )
    problem = replace(nothing.problem, shared=freed)
    sizes, hypotheses = search.nothing().sizes, len(search.names)
    initial = not_fitted(problem, nothing.x)
    found = fitted(NOTHING, initial, sizes, search.limits, hypotheses, search.nothing().minus_twice_log)
    off_nominal = _off_nominal(search, found)
    if not off_nominal:
        return None
    chosen = choices_of(frozenset(value.name for value in off_nominal), hypotheses + sum(trusted))
    return FreeLine(found.score + 2.0 * chosen, not any(test.failed for test in tests(found)), off_nominal)


def _off_nominal(search: Search, found: Hypothesis) -> tuple[OffNominal, ...]:
    spread = np.sqrt(np.maximum(np.diag(covariance(found)), 0.0))
    clear = []
    for i, trusted in enumerate(search.nothing().result.problem.shared):
        ratio = float(found.result.x[i])
        by = max(trusted.low - ratio, ratio - trusted.high)
        if not trusted.effect and trusted.low < trusted.high and by > CLEARLY * spread[i]:
            sureness = by / max(float(spread[i]), np.finfo(float).tiny)
            given, unit = search.model.parameters[trusted.name], parameter_unit(trusted.name, search.model.motion)
            clear.append((sureness, OffNominal(trusted.name, ratio, trusted.high - 1.0, given.value, unit)))
    return tuple(value for _, value in sorted(clear, key=lambda each: -each[0]))


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
class Rivals:
    """What the names of the best set are weighed against."""

    alone: Law | None  # the best law without a name
    added: Law | None
    sheet: FreeLine | None
    searches: list[ElementSearch]  # for the law alone, element by element
    scores: tuple[Score, ...]  # those of all these


def rivals_of(search: Search, ground: Grounds) -> Rivals:
    """Fit laws without a name, and the nominal line with its values free."""
    nothing, best = of_first_outputs(ground.nothing), of_first_outputs(ground.best)
    searches = searches_around(nothing)
    alone = best_law(nothing, searches)
    added = alone if ground.best is ground.nothing else best_law(best, searches_around(best))
    sheet = free_line(search)
    off = () if sheet is None else (Score(NOTHING, sheet.score),)
    return Rivals(alone, added, sheet, searches, (*rival_laws(ground, alone, added), *off))


def rival_laws(ground: Grounds, alone: Law | None, added: Law | None) -> tuple[Score, ...]:
    """Return laws without a name as hypotheses: one instead of all effects, and one added to the best set of these."""
    best, first = of_first_outputs(ground.best), of_first_outputs(ground.nothing)
    offset = ground.best.score - best.score
    found = []
    if alone is not None and 1.0 - (alone.rms / free_rms(first)) ** 2 >= LEAST_SHARE:
        found.append(Score(_at_its_place(ground, alone, first.score - alone.score), offset + alone.score))
    if added is not None and best.effects:
        found.append(Score(best.effects, offset + added.score))
    return tuple(found)


def _at_its_place(ground: Grounds, law: Law, gained: float) -> Effects:
    """Return the names of which a law is another form: those at its place, where they gain nearly all that it gains."""
    names = frozenset(name for name in ground.best.effects if EFFECTS[name].element is law.element)
    score = {each.effects: each.score for each in ground.scores}.get(names, math.inf)
    is_form = ground.nothing.score - score >= (1.0 - MOST_FORM**2) * gained
    return names if is_form else NOTHING
