"""The answer: from recordings that are fit for a diagnosis to what it says of them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from estimator.diagnosis.assemble import augmented_model, load_torques, retuned_parameters
from estimator.diagnosis.chain import mechanical, read_through
from estimator.diagnosis.hypotheses import Progress, open_hypotheses
from estimator.diagnosis.inference.calibration import CLEARLY_BELOW
from estimator.diagnosis.inference.data_sheet import free_line
from estimator.diagnosis.inference.disturbances import reading_noise
from estimator.diagnosis.inference.figures import FreeRuns, courses_of, effects_of, figures_of, free_runs, traces_of
from estimator.diagnosis.inference.free_run import Unseen
from estimator.diagnosis.inference.likelihood import SAME, Hypothesis, fitted, of_first_outputs
from estimator.diagnosis.inference.posterior import free_rms
from estimator.diagnosis.inference.read_again import searched
from estimator.diagnosis.inference.remainder import tests
from estimator.diagnosis.inference.search import Search
from estimator.diagnosis.inference.unnamed import (
    Law,
    against_rival,
    at_place,
    best_law,
    hunts_around,
    weighed_against,
)
from estimator.diagnosis.inference.verdict import Decision, decide, spread, verdict_of
from estimator.diagnosis.inference.wording import statement, tests_in_words
from estimator.diagnosis.phrases import law_in_words
from estimator.diagnosis.preconditions import Prepared
from estimator.diagnosis.result import (
    Diagnosis,
    Discrepancy,
    Fit,
    FoundEffect,
    Interval,
    Mismatch,
    RejectedEffect,
    Remainder,
    Slight,
    Stray,
    UnnamedLaw,
    UntestableEffect,
    Verdict,
)
from estimator.diagnosis.unnamed import Hunt
from estimator.diagnosis.where import discrepancy, locate
from estimator.physics.effect import Element, Untestable
from estimator.physics.fit import not_fitted
from estimator.physics.model import DrivelineModel
from estimator.physics.steps import from_their_moment
from estimator.signals.record import FloatArray

SMALLEST_P = 1e-300

SEARCH_SHARE = 0.7
"""Share of the budget for the search; the rest is for laws without a name and the free runs of the answer."""


def answer(ready: Prepared, model: DrivelineModel, progress: Progress, budget_s: float) -> Diagnosis:
    """Return the diagnosis of recordings that are fit for one; after ``budget_s`` of the best set of effects so far."""
    began, search_s = time.perf_counter(), SEARCH_SHARE * budget_s

    def is_over() -> bool:
        spent_s = time.perf_counter() - began
        progress("comparing hypotheses", min(0.1 + 0.7 * spent_s / max(search_s, spent_s, 1e-9), 0.8))
        return spent_s >= search_s

    line, chain = mechanical(model), read_through(ready.records)
    found = searched(chain, line, is_over)
    chain, search, untestable = found.chain, found.search, open_hypotheses(line, found.chain.records)[1]
    decision = decide(search, found.grounds, with_findings=bool(chain.findings))
    seen = _looked_at(search, decision, is_over)
    progress("simulating what was found", 0.9)
    unseen = Unseen(line, read_through(ready.holdout).records)
    runs = free_runs(seen.decision.nothing, seen.believed, not seen.decision.failed, chain, unseen)
    if seen.believed is not seen.decision.nothing and runs.final.rms > CLEARLY_BELOW * spread(runs.final.problem):
        seen = _abstained(seen)  # what held on thinned samples does not at the recordings' own rate
        runs = free_runs(seen.decision.nothing, seen.believed, False, chain, unseen)
    said = _said(seen, runs, search, untestable, model)
    progress("done", 1.0)
    warnings = (_stopped(search, budget_s),) if search.stopped else ()
    return replace(said, warnings=warnings, timing_s={"total": time.perf_counter() - began})


def _said(
    seen: _Seen, runs: FreeRuns, search: Search, untestable: Mapping[str, Untestable], model: DrivelineModel
) -> Diagnosis:
    decision, line = seen.decision, search.model
    figures, effects = figures_of(runs, noise_of(decision.best)), effects_of(runs, decision)
    blind = tuple(UntestableEffect(n, u.reason, u.suggested_test, u.needs) for n, u in untestable.items())
    mismatch, remainder = _mismatch(seen, effects), _remainder(seen)
    values_of = decision.best.plain.values_of
    return Diagnosis(
        verdict=decision.verdict,
        statement=statement(decision, effects, figures, blind, remainder, seen.strays),
        mismatch=mismatch,
        effects=effects,
        rejected=_rejected(search, decision),
        untestable=blind,
        unnamed=_unnamed(seen, figures),
        fit=figures,
        parameters=retuned_parameters(runs.estimate, line, decision.verdict is not Verdict.UNEXPLAINED),
        load_torque=load_torques(runs.estimate, line),
        timing_s={},
        augmented=augmented_model(runs.estimate, model, (*effects, *traces_of(runs, decision))),
        traces=courses_of(runs),
        discrepancy=_discrepancy(seen, line) if mismatch.detected and line.plant is None else None,
        remainder=remainder,
        strays=seen.strays,
        slight=tuple(Slight(each.name, each.share, values_of(each.name)) for each in decision.traces),
    )


@dataclass(frozen=True, slots=True)
class _Seen:
    """A decision, and the laws without a name around it.

    Attributes
    ----------
    believed : Hypothesis
        What the answer is of, and the augmented model holds: the effects that are named, and traces.
    hunts : list of Hunt
        The search for a law without any effect; empty where it was not made.
    law : Law or None
        What is left beyond noise, as a law without a name.
    strays : tuple of Stray
        Nominal values that alone, beyond what they are trusted to, would leave nothing but noise.
    """

    decision: Decision
    believed: Hypothesis
    hunts: list[Hunt]
    law: Law | None
    strays: tuple[Stray, ...] = ()


def _looked_at(search: Search, decision: Decision, is_over: Callable[[], bool]) -> _Seen:
    """Weigh the names against a law without one, and look for the law of what is left while there is time.

    No name stands that was not weighed so: a law outside the catalogue is imitated by sets of those within.
    """
    hunts: list[Hunt] = []
    law: Law | None = None
    if decision.failed or decision.named:
        nothing = of_first_outputs(decision.nothing)
        hunts = hunts_around(nothing)
        law = best_law(nothing, hunts)
        decision = weighed_against(decision, law, partial(at_place, search, decision))
    line = free_line(search) if decision.failed or decision.named else None
    if line is not None:
        decision = against_rival(decision, line.score, lambda each: True)
    believed = decision.nothing
    if decision.verdict in (Verdict.EXPLAINED, Verdict.PARTLY_EXPLAINED):
        decision, believed = _without_doubted(search, decision)
    if decision.verdict not in (Verdict.EXPLAINED, Verdict.PARTLY_EXPLAINED):
        strays = line.strays if line is not None and line.leaves_noise else ()
        return _Seen(replace(decision, named=()), decision.nothing, hunts, law, strays)
    is_left = bool(decision.failed) and not is_over()
    first = of_first_outputs(believed)
    left = best_law(first, hunts_around(first)) if is_left else None
    return _Seen(decision, believed, hunts, left)


def _abstained(seen: _Seen) -> _Seen:
    """Return what is left to say where what is believed leaves as much as the signal itself."""
    decision = replace(seen.decision, verdict=Verdict.UNEXPLAINED, named=(), traces=())
    law = best_law(of_first_outputs(decision.nothing), seen.hunts) if seen.hunts else None
    return _Seen(decision, decision.nothing, seen.hunts, law)


def _without_doubted(search: Search, decision: Decision) -> tuple[Decision, Hypothesis]:
    """Return a decision on the effects that are established, traces among them, and the set of these."""
    established = decision.best
    for name in sorted(established.effects - {each.name for each in (*decision.named, *decision.traces)}):
        established = search.without(established, name)
    if established is not decision.best:
        failed = tuple(test for test in tests(established) if test.failed)
        of_spread = free_rms(established) / spread(established.plain.problem)
        decision = replace(decision, verdict=verdict_of(of_spread, True, bool(failed)), failed=failed)
    return decision, _steps_from_their_moment(search, established)


def _steps_from_their_moment(search: Search, believed: Hypothesis) -> Hypothesis:
    """Return a hypothesis with steps of payload or stiffness that begin inside recordings, where it is as probable."""
    turned = from_their_moment(believed.plain, search.model)
    if turned is believed.plain:
        return believed
    found = fitted(
        believed.effects,
        not_fitted(turned.problem, turned.x),
        believed.sizes,
        believed.limits,
        len(search.names),
        believed.minus_twice_log,
    )
    return found if found.score <= believed.score + SAME else believed


def _stopped(search: Search, budget_s: float) -> str:
    untried = sorted({*search.names} - {*search.rivals} - {name for effects in search.visited for name in effects})
    fitted = f"; no fit was made of {', '.join(untried)}" if untried else ""
    return (
        f"the search ended after its {budget_s:g} s with the best set of effects so far; further effects, and "
        f"look-alikes of those named, were not tried{fitted}. Give it more time (--budget-s), or fewer or shorter "
        "recordings."
    )


def noise_of(hypothesis: Hypothesis) -> float:
    """Return the reading's noise, white and coloured [unit of the output]."""
    return float(reading_noise(hypothesis.sizes)[0])


def _errors(hypothesis: Hypothesis) -> list[FloatArray]:
    """Return the free-run error per recording, 0 where a sample is missing."""
    plain = hypothesis.plain.first_outputs()
    return [np.where(r.okay, r.output - out, 0.0) for r, out in zip(plain.problem.records, plain.outputs, strict=True)]


def _band_hz(hypothesis: Hypothesis, noise: float) -> Interval | None:
    errors = _errors(hypothesis)
    return locate.band_hz(errors, [hypothesis.plain.problem.records[0].sample_time_s] * len(errors), noise)


def _mismatch(seen: _Seen, effects: Sequence[FoundEffect]) -> Mismatch:
    decision = seen.decision
    if decision.verdict is Verdict.NO_MISMATCH:
        return Mismatch(False, None, {}, None, None, 1.0)
    nothing, noise = decision.nothing.plain.first_outputs(), noise_of(decision.best)
    element: Element | None = None if seen.law is None else seen.law.element
    if effects or seen.strays:
        element = (effects or seen.strays)[0].element
    gained = max(decision.nothing.score - decision.best.score, 0.0)
    return Mismatch(
        detected=True,
        element=element,
        time_s=locate.intervals(nothing, noise),
        band_hz=_band_hz(decision.nothing, noise),
        region=None if element is None else locate.region(nothing, element, noise),
        p_value=max(math.exp(-0.5 * gained), SMALLEST_P),
    )


def _discrepancy(seen: _Seen, line: DrivelineModel) -> Discrepancy:
    """Return the mismatch as the report draws it."""
    noise = noise_of(seen.decision.best)
    nothing, believed = of_first_outputs(seen.decision.nothing), seen.believed.plain.first_outputs()
    return discrepancy(
        nothing.plain, believed, noise, line.motion, rounds=1, begun=seen.hunts, whitening=nothing.filter
    )


def _rejected(search: Search, decision: Decision) -> tuple[RejectedEffect, ...]:
    """Return the rivals that were fitted, the nearest first, and then those that were looked at only.

    ``delta_bic`` is by how much the best set with a rival is less probable than the best of all; of one that was not
    fitted, as if it gained nothing. A rough fit can seem more probable than it is.
    """
    named = {each.name for each in (*decision.named, *decision.traces)}
    best, nothing = decision.best.score, decision.nothing.score
    fitted = [
        RejectedEffect(
            name,
            "tried instead of what was found and in addition to it: the recordings are explained no better",
            min(best - score, 0.0) if name not in decision.best.effects else 0.0,
        )
        for name, score in sorted(search.rivals.items(), key=lambda item: item[1])
        if name not in named
    ]
    looked_at = [
        RejectedEffect(name, "not fitted: alone it would remove next to nothing of the error", best - nothing)
        for name in search.names
        if name not in named and name not in search.rivals and name not in decision.best.effects
    ]
    return (*fitted, *looked_at)


def _remainder(seen: _Seen) -> Remainder | None:
    """Return what is left beyond noise and drift; None where nothing is."""
    decision, believed, law = seen.decision, seen.believed, seen.law
    if not decision.failed:
        return None
    noise, left = noise_of(decision.best), free_rms(believed)
    said = tests_in_words(decision.failed) if law is None else law_in_words(law.element, law.terms)
    return Remainder(
        share=max(left**2 - noise**2, 0.0) / free_rms(decision.nothing) ** 2,
        times_noise=left / noise,
        element=None if law is None else law.element,
        band_hz=_band_hz(believed, noise),
        law=said,
    )


def _unnamed(seen: _Seen, figures: Fit) -> UnnamedLaw | None:
    if seen.decision.verdict is not Verdict.UNEXPLAINED or seen.law is None:
        return None
    return UnnamedLaw(seen.law.element, seen.law.terms, figures.retuned, seen.law.rms)
