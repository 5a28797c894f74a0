"""The answer: from recordings that are fit for a diagnosis to what it says of them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.acquisition.chain import Chain, mechanical, read_through
from estimator.diagnosis.assemble import augmented_model, load_torques, moved_values, retuned_parameters
from estimator.diagnosis.inference.checks import Test, tests, tests_in_words
from estimator.diagnosis.inference.disturbances import reading_noise
from estimator.diagnosis.inference.figures import (
    FreeRuns,
    Unseen,
    acquired,
    courses_of,
    effects_of,
    figures_of,
    figures_without,
    first_figures,
    free_runs,
    on_recordings,
    traces_of,
)
from estimator.diagnosis.inference.hypotheses import (
    SAME,
    Hypothesis,
    Progress,
    everything,
    fitted,
    of_first_outputs,
    open_hypotheses,
    silent,
)
from estimator.diagnosis.inference.judge import (
    Belief,
    Decision,
    Grounds,
    decide,
    error_falls,
    free_rms,
    grounds,
    spread,
    verdict_of,
)
from estimator.diagnosis.inference.rivals import Law, best_law, rivals_of, searches_around
from estimator.diagnosis.inference.search import Search
from estimator.diagnosis.inference.wording import Context, law_in_words, statement
from estimator.diagnosis.noise import SMALLEST_P, noise_floor
from estimator.diagnosis.preconditions.prepare import Prepared, as_slow_as_needed
from estimator.diagnosis.result import (
    Diagnosis,
    Discrepancy,
    Effort,
    Estimated,
    Fit,
    FoundEffect,
    Interval,
    Mismatch,
    OffNominal,
    RejectedEffect,
    Remainder,
    Retuned,
    Slight,
    UnnamedLaw,
    UntestableEffect,
    Verdict,
)
from estimator.diagnosis.unnamed.search import ElementSearch
from estimator.diagnosis.where import locate
from estimator.diagnosis.where.discrepancy import discrepancy
from estimator.physics.effect import Element, Untestable
from estimator.physics.fit import not_fitted
from estimator.physics.model import DrivelineModel
from estimator.physics.parallel import TimeIsUp, Work, counted
from estimator.physics.steps import from_their_moment
from estimator.signals.record import FloatArray, separated_outputs


@dataclass(frozen=True, slots=True)
class Found:
    """What a search found, and the recordings as they were read for it."""

    chain: Chain
    search: Search
    grounds: Grounds


def searched(
    chain: Chain,
    line: DrivelineModel,
    work: Work | None = None,
    most: float = math.inf,
    watch: Callable[[Search], None] = lambda _search: None,
    progress: Progress = silent,
) -> Found:
    """Search for what is missing; once more where the errors of what is found show jitter."""

    def found_in(of: Chain) -> Found:
        search = _search(of, line, work or Work(), most)
        search.progress = progress
        watch(search)
        return Found(of, search, grounds(search))

    found = found_in(chain)
    if found.search.stopped:
        return found
    free = on_recordings(found.grounds.best, line, chain.separated, is_whole=True)
    steady = chain.with_jitter_in(free.first_outputs())
    return found if steady is chain else found_in(steady)


def _search(chain: Chain, line: DrivelineModel, work: Work, most: float) -> Search:
    fitted_to = separated_outputs(as_slow_as_needed(chain.records, line), noise_floor)
    names = open_hypotheses(line, chain.records)[0]
    return Search(line, fitted_to, everything(fitted_to), names, work=work, most=most)


LEVELS: Mapping[str, int] = {"quick": 4_000, "normal": 40_000, "thorough": 400_000}
"""Free runs of all recordings after which a search makes no further step: a choice of how long people wait."""


def answer(
    ready: Prepared,
    model: DrivelineModel,
    progress: Progress,
    level: str,
    work: Work,
    keep: Callable[[Found], None] = lambda _found: None,
) -> Diagnosis:
    """Return the diagnosis of recordings that are fit for one; undecided where the limit of time ends it.

    ``keep`` is given what the search found, for those who continue with it.
    """
    began = time.perf_counter()
    line, chain = mechanical(model), read_through(ready.records)
    search: Search | None = None

    def watched(started: Search) -> None:
        nonlocal search
        search = started

    with counted(work):
        try:
            found = searched(chain, line, work, LEVELS[level], watched, progress)
            keep(found)
            diagnosis = _decided(found, line, ready, model, progress, level)
        except TimeIsUp:
            diagnosis = None
    if diagnosis is None:
        diagnosis = _undecided(search, chain, line, model, level, work)
    progress("done", 1.0)
    return replace(diagnosis, timing_s={"total": time.perf_counter() - began})


def _decided(
    found: Found, line: DrivelineModel, ready: Prepared, model: DrivelineModel, progress: Progress, level: str
) -> Diagnosis:
    progress("weighing what was found", 0.8)
    seen = _seen(found.search, found.grounds)
    progress("simulating what was found", 0.9)
    unseen = Unseen(line, read_through(ready.holdout))
    runs = free_runs(seen.decision.nothing, seen.believed, not seen.failed, found.chain, unseen)
    return _said(seen, runs, found.search, model, level)


@dataclass(frozen=True, slots=True)
class _Seen:
    """A decision, and the laws without a name around it."""

    decision: Decision
    believed: Hypothesis
    failed: tuple[Test, ...]
    searches: list[ElementSearch]
    alone: Law | None
    left: Law | None
    off_nominal: tuple[OffNominal, ...] = ()


def _seen(search: Search, ground: Grounds) -> _Seen:
    """Weigh the names against laws without one and values off the data sheet, and fit what is believed.

    No name stands that was not weighed so: a law outside the catalogue is imitated by sets of those within.
    """
    failed = tuple(test for test in ground.tests if test.failed)
    if not failed and not ground.best.effects:
        return _Seen(decide(search, ground), ground.nothing, (), [], None, None)
    rivals = rivals_of(search, ground)
    decision = decide(search, ground, rivals.scores)
    believed = _without_doubted(search, decision)
    alone, sheet, searches = rivals.alone, rivals.sheet, rivals.searches
    if not decision.named:
        off_nominal = sheet.off_nominal if sheet is not None and sheet.leaves_noise else ()
        return _Seen(decision, ground.nothing, failed or (), searches, alone, alone, off_nominal)
    if believed is ground.best:
        return _Seen(decision, believed, failed, searches, alone, rivals.added if failed else None)
    failed, first = tuple(test for test in tests(believed) if test.failed), of_first_outputs(believed)
    left = best_law(first, searches_around(first)) if failed else None
    return _Seen(decision, believed, failed, searches, alone, left)


def _without_doubted(search: Search, decision: Decision) -> Hypothesis:
    """Return the set of the effects that are established, traces among them."""
    believed = decision.best
    for name in sorted(believed.effects - {each.name for each in (*decision.named, *decision.traces)}):
        believed = search.without(believed, name)
    return _steps_from_their_moment(search, believed)


def _steps_from_their_moment(search: Search, believed: Hypothesis) -> Hypothesis:
    """Return a hypothesis with steps of payload or stiffness that begin inside recordings, where it is as probable."""
    turned = from_their_moment(believed.result, search.model)
    if turned is believed.result:
        return believed
    initial = not_fitted(turned.problem, turned.x)
    names = len(search.names)
    found = fitted(believed.effects, initial, believed.sizes, believed.limits, names, believed.minus_twice_log)
    return found if found.score <= believed.score + SAME else believed


def _said(seen: _Seen, runs: FreeRuns, search: Search, model: DrivelineModel, level: str) -> Diagnosis:
    """Return the diagnosis: names only where the error falls, on data not used for the fit, too."""
    decision, findings, chain = seen.decision, acquired(runs), runs.chain
    figures = figures_of(runs, noise_of(decision.best), findings)
    is_named = bool(decision.named or findings)
    of_spread = runs.final.rms / spread(runs.final.problem)
    verdict = verdict_of(of_spread, is_named, bool(seen.failed), error_falls(figures))
    if decision.named and verdict is Verdict.UNEXPLAINED:
        reason = "it leaves as much as the signal itself" if error_falls(figures) else _does_not_fall(figures)
        return _said(*_abstained(seen, runs, reason), search, model, level)
    effects = (*effects_of(runs, decision), *findings) if verdict is not Verdict.UNEXPLAINED else ()
    line, effort = search.model, _effort(search, level, decision)
    blind = _untestable(open_hypotheses(line, chain.records)[1])
    mismatch, remainder = _mismatch(seen, verdict, effects), _remainder(seen)
    traces = (*decision.traces,) if verdict is not Verdict.UNEXPLAINED else ()
    named = {each.name for each in effects} | {each.name for each in traces}
    named |= {name for each in effects for name in each.indistinguishable_from}
    slight = tuple(_slight(each, decision.best, search) for each in traces)
    context = Context(
        remainder,
        slight,
        seen.off_nominal,
        blind,
        can_be_retuned(line),
    )
    return Diagnosis(
        verdict=verdict,
        statement=statement(verdict, figures, effects, effort, context),
        mismatch=mismatch,
        effects=effects,
        rejected=_rejected(search, decision, named, {*effort.untried}),
        untestable=blind,
        unnamed=_unnamed(seen, verdict, figures),
        fit=figures,
        parameters=retuned_parameters(runs.estimate, line, verdict is not Verdict.UNEXPLAINED),
        load_torque=load_torques(runs.estimate, line),
        timing_s={},
        augmented=augmented_model(runs.estimate, model, (*effects, *(traces_of(runs, decision) if traces else ()))),
        traces=courses_of(runs),
        warnings=_warnings(search, level),
        discrepancy=_discrepancy(seen, line) if mismatch.detected and line.plant is None else None,
        remainder=remainder,
        off_nominal=seen.off_nominal,
        slight=slight,
        effort=effort,
    )


def _slight(trace: Belief, best: Hypothesis, search: Search) -> Slight:
    """Return a trace; without it some values are others, though the error hardly is."""
    without = search.without(best, trace.name)
    return Slight(trace.name, trace.share, best.result.values_of(trace.name), moved_values(best, without.result))


def can_be_retuned(line: DrivelineModel) -> bool:
    """Tell whether a parameter is fitted: of a plant simulated elsewhere those that it can be given."""
    return line.plant is None or any(parameter.tolerance > 0.0 for parameter in line.parameters.values())


def _does_not_fall(fit: Fit) -> str:
    return (
        f"with it the free-run error goes from {fit.retuned:.4g} to {fit.augmented:.4g} {fit.unit}, on samples "
        f"not used for the fit from {fit.holdout_retuned:.4g} to {fit.holdout_augmented:.4g}"
    )


def _abstained(seen: _Seen, runs: FreeRuns, reason: str) -> tuple[_Seen, FreeRuns]:
    decision = seen.decision
    doubted = tuple(replace(each, objection=reason) for each in (*decision.named, *decision.traces))
    decision = replace(decision, named=(), traces=(), doubted=(*doubted, *decision.doubted))
    nothing = decision.nothing
    failed = tuple(test for test in tests(nothing) if test.failed)
    runs = replace(runs, believed=nothing, is_whole=False, after=runs.before, held_after=runs.held_before)
    return _Seen(
        decision, nothing, failed or seen.failed, seen.searches, seen.alone, seen.alone, seen.off_nominal
    ), runs


def _undecided(
    search: Search | None, chain: Chain, line: DrivelineModel, model: DrivelineModel, level: str, work: Work
) -> Diagnosis:
    """Return the answer of a search that the limit of time has ended: nothing is decided, and nothing rejected."""
    names, blind = open_hypotheses(line, chain.records)
    nothing = None if search is None else search.visited.get(frozenset())
    parameters, loads, augmented = dict[str, Retuned](), dict[str, Estimated](), model
    try:
        fit, estimate = first_figures(chain, line, nothing)
        augmented = augmented_model(estimate, model, ())
        parameters, loads = retuned_parameters(estimate, line, False), load_torques(estimate, line)
    except TimeIsUp:  # the whole limit, after which another program simulates no more
        fit = figures_without(chain, line, nothing)
    tried = set() if search is None else {*search.rivals, *search.implausible}
    untried = tuple(name for name in names if name not in tried)
    simulations = 0 if search is None else search.simulations
    effort = Effort(level, simulations, False, untried, len(names), work.limit_s)
    untestable = _untestable(blind)
    context = Context(untestable=untestable, can_be_retuned=can_be_retuned(line))
    return Diagnosis(
        verdict=Verdict.UNEXPLAINED,
        statement=statement(Verdict.UNEXPLAINED, fit, (), effort, context),
        mismatch=Mismatch(True, None, {}, None, None, math.nan),
        effects=(),
        rejected=(),
        untestable=untestable,
        unnamed=None,
        fit=fit,
        parameters=parameters,
        load_torque=loads,
        timing_s={},
        augmented=augmented,
        traces=(),
        effort=effort,
    )


def _untestable(blind: Mapping[str, Untestable]) -> tuple[UntestableEffect, ...]:
    return tuple(UntestableEffect(n, u.reason, u.suggested_test, u.needs) for n, u in blind.items())


def _effort(search: Search, level: str, decision: Decision) -> Effort:
    """Return what the search cost; ``untried`` is what looked worth a fit and had none."""
    settled = {*search.rivals, *search.implausible, *(name for effects in search.visited for name in effects)}
    best = decision.best.score
    untried = tuple(
        name for name in search.names if name not in settled and search.foreseen.get(name, -math.inf) < best
    )
    return Effort(level, search.simulations, True, untried, len(search.names))


def _warnings(search: Search, level: str) -> tuple[str, ...]:
    if not search.stopped:
        return ()
    return (
        f"the search ended with the best set of effects so far, after the {LEVELS[level]:,} simulations of its effort "
        f"({level}); further effects, and look-alikes of those named, were not tried. Try --effort thorough, or fewer "
        "recordings.",
    )


def noise_of(hypothesis: Hypothesis) -> float:
    """Return the reading's noise, white and coloured [unit of the output]."""
    return float(reading_noise(hypothesis.sizes)[0])


def _errors(hypothesis: Hypothesis) -> list[FloatArray]:
    """Return the free-run error per recording, 0 where a sample is missing."""
    result = hypothesis.result.first_outputs()
    return [
        np.where(r.okay, r.output - out, 0.0) for r, out in zip(result.problem.records, result.outputs, strict=True)
    ]


def _band_hz(hypothesis: Hypothesis, noise: float) -> Interval | None:
    errors = _errors(hypothesis)
    return locate.band_hz(errors, [hypothesis.result.problem.records[0].sample_time_s] * len(errors), noise)


def _mismatch(seen: _Seen, verdict: Verdict, effects: Sequence[FoundEffect]) -> Mismatch:
    decision = seen.decision
    if verdict is Verdict.NO_MISMATCH:
        return Mismatch(False, None, {}, None, None, 1.0)
    nothing, noise = decision.nothing.result.first_outputs(), noise_of(decision.best)
    law = seen.alone if seen.left is None else seen.left
    element: Element | None = None if law is None else law.element
    if effects or seen.off_nominal:
        element = (effects or seen.off_nominal)[0].element
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
    nothing, believed = of_first_outputs(seen.decision.nothing), seen.believed.result.first_outputs()
    return discrepancy(
        nothing.result, believed, noise, line.motion, rounds=1, initial=seen.searches, whitening=nothing.filter
    )


def _rejected(search: Search, decision: Decision, named: set[str], untried: set[str]) -> tuple[RejectedEffect, ...]:
    """Return the rivals that lost, the nearest first, each with what was done and by how much it is worse.

    ``delta_bic`` is by how much the best set with a rival is less probable than the best of all: fitted, or as a score
    test foresees it at most.
    """
    best = decision.best.score
    doubted = {each.name: RejectedEffect(each.name, each.reason, 0.0) for each in decision.doubted}
    scores = (
        (_fitted(search), "fitted: the best set with it is {} in minus twice the log-probability"),
        (
            search.implausible,
            "fitted, and ended at values that are no case of it: {} in minus twice the log-probability",
        ),
        (search.foreseen, "not fitted: a score test foresees that on top of what was found it makes that {} at best"),
    )
    found = dict(doubted)
    for known, reason in scores:
        for name, score in sorted(known.items(), key=lambda item: item[::-1]):  # not as cores came to their end
            if name not in found:
                found[name] = RejectedEffect(name, reason.format(_compared(score - best)), min(best - score, 0.0))
    found = {name: each for name, each in found.items() if name not in named and name not in untried}
    return tuple(sorted(found.values(), key=lambda each: -each.delta_bic))


def _fitted(search: Search) -> dict[str, float]:
    """Return the best score of a set with each effect that was fitted, to its end or a few steps."""
    scores = dict(search.rivals)
    for effects, each in search.visited.items():
        for name in effects if search.is_plausible(each) else ():
            scores[name] = min(each.score, scores.get(name, math.inf))
    return scores


def _compared(worse: float) -> str:
    """Say by how much a score is worse than that of the best set; as good where it differs by less than a tenth."""
    if abs(worse) < 0.1:
        return "as good as without"
    return f"{'worse' if worse > 0.0 else 'better'} by {abs(worse):.3g}"


def _remainder(seen: _Seen) -> Remainder | None:
    believed, law = seen.believed, seen.left
    if not seen.failed:
        return None
    noise, left, failed = noise_of(seen.decision.best), free_rms(believed), tests_in_words(seen.failed)
    return Remainder(
        share=min(max(left**2 - noise**2, 0.0) / free_rms(seen.decision.nothing) ** 2, 1.0),
        times_noise=left / noise,
        element=None if law is None else law.element,
        band_hz=_band_hz(believed, noise),
        law=failed if law is None else law_in_words(law.element, law.terms),
        tests=failed,
    )


def _unnamed(seen: _Seen, verdict: Verdict, figures: Fit) -> UnnamedLaw | None:
    law = seen.alone
    if verdict is not Verdict.UNEXPLAINED or law is None:
        return None
    return UnnamedLaw(law.element, law.terms, figures.retuned, law.rms)
