"""The effects of a decision as a diagnosis tells them: values, intervals, moments, share and probability."""

from __future__ import annotations

import math

from estimator.diagnosis.assemble import moments_in, parameters_of, profile_size, profiles_of
from estimator.diagnosis.inference.judge import Belief, Decision, free_rms
from estimator.diagnosis.inference.plausible import GRADE
from estimator.diagnosis.intervals import reported_covariance
from estimator.diagnosis.result import Evidence, FoundEffect
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult, fit, warm_start
from estimator.physics.model import DrivelineModel
from estimator.physics.problem import make_problem
from estimator.signals.record import FloatArray

SMALLEST_P = 1e-300


def found_effects(
    decision: Decision, estimate: FitResult, cov: FloatArray, model: DrivelineModel
) -> tuple[FoundEffect, ...]:
    """Return the named effects, the weightiest first, with the values and covariance of a fit."""
    return tuple(_found(belief, decision, estimate, cov, model) for belief in decision.named)


def _found(
    belief: Belief, decision: Decision, estimate: FitResult, cov: FloatArray, model: DrivelineModel
) -> FoundEffect:
    entry, best = EFFECTS[belief.name], decision.best
    nulls = {parameter.name: parameter.null for parameter in entry.parameters}
    profiles = {}
    if belief.name == GRADE:
        of = best.plain.problem
        problem = make_problem(model, of.records, of.shared, own=[b.own for b in of.local], profile=True, use=of.use)
        course = fit(problem, warm_start(problem, best.plain))
        of_course = reported_covariance(course)
        profiles, parameters = profiles_of(course, of_course, model), profile_size(course, of_course, model)
    else:
        parameters = parameters_of(belief.name, estimate, cov, model)
    return FoundEffect(
        name=entry.name,
        element=entry.element,
        statement=entry.sentence(nulls | {name: p.value for name, p in parameters.items()}, model.motion),
        parameters=parameters,
        time_s=moments_in(belief.name, estimate) if entry.event else {},
        indistinguishable_from=tuple(belief.alike),
        alternatives=belief.alike,
        evidence=Evidence(
            belief.score,
            free_rms(decision.nothing),
            free_rms(best),
            max(math.exp(-0.5 * max(belief.score, 0.0)), SMALLEST_P),
        ),
        profiles=profiles,
        share=belief.share,
        probability=belief.probability,
        form=entry.form({name: p.value for name, p in parameters.items()}),
    )
