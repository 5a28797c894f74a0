"""What is said: the result of a diagnosis, made from the records of decision and search and from nothing else.

Values with their intervals, the place of a mismatch, the statement; and what was tried: every set that was fitted, what
the search cost, and why effects are rejected.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from typing import NamedTuple

from estimator.diagnosis.acquisition.chain import Chain
from estimator.diagnosis.assemble import (
    augmented_model,
    can_be_retuned,
    found_effect,
    load_torques,
    retuned_parameters,
    slight,
)
from estimator.diagnosis.covariance import estimate_of, reported_covariance
from estimator.diagnosis.inference.decide import Decision, Judged
from estimator.diagnosis.inference.figures import figures_without, first_figures
from estimator.diagnosis.inference.fits import Fits
from estimator.diagnosis.inference.hypotheses import Effects, Hypothesis, open_hypotheses
from estimator.diagnosis.inference.remainder import Test
from estimator.diagnosis.inference.search import Search
from estimator.diagnosis.inference.trials import Standing, Trial
from estimator.diagnosis.line.line import line_values
from estimator.diagnosis.preconditions.agreement import is_answered
from estimator.diagnosis.result import (
    Diagnosis,
    Discrepancy,
    Doubt,
    Effort,
    Estimated,
    FittedSet,
    FoundEffect,
    Mismatch,
    Refinement,
    RejectedEffect,
    Remainder,
    Retuned,
    Slight,
    UntestableEffect,
    Verdict,
)
from estimator.diagnosis.tables import NO_LAW, Law
from estimator.diagnosis.thresholds import Noise, Telling
from estimator.diagnosis.where import locate
from estimator.diagnosis.where.discrepancy import courses_of, discrepancy
from estimator.diagnosis.wording import Context, compared, statement
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element, Untestable
from estimator.physics.model import DrivelineModel
from estimator.physics.parallel import TimeIsUp, Work
from estimator.physics.tables import TABLES


@dataclass(frozen=True, slots=True)
class Basis:
    """What a result is made from: the decision, and what the search did."""

    decision: Decision  # what is believed
    search: Search  # sets that were fitted
    model: DrivelineModel  # as it was given, with what the line reads through
    effort: Effort  # simulations and time spent
    warnings: tuple[str, ...] = ()  # about the recordings, as sentences
    law: Law | None = None  # without a name, next to what is decided
    doubts: Sequence[Doubt] = ()  # about the input, before what was found

    @property
    def refinements(self) -> tuple[Standing, ...]:
        """What is possible and not in the model: without what a law without a name has."""
        held = () if self.law is None else self.law.found.effects
        return tuple(each for each in self.decision.judged.refinements if each.name not in held)


def said(basis: Basis) -> Diagnosis:
    """Return the diagnosis: values with their intervals, the place, what was tried, and all of it in words."""
    decision, law = basis.decision, basis.law
    judged, runs, verdict, line = decision.judged, decision.runs, decision.verdict, basis.search.fits.model
    values, courses, seen = _values(basis), courses_of(runs), _discrepancy(basis)
    mismatch, remainder = _mismatch(basis, seen), _remainder(decision, law)

    before = line_values(judged.believed.hypothesis.result)
    doubts = tuple(d for d in basis.doubts if not is_answered(d, values.named, line, before, runs.chain.records))
    is_uncounted = bool(doubts) or any(name in TABLES for name in line.effects)
    effects = _as_sure_as(is_uncounted, values.added)
    elsewhere = {*basis.effort.untried, *(() if law is None else law.found.effects)}
    others = rejected(basis.search.fits, decision, basis.refinements, elsewhere)
    untestable = _not_looked_at(basis, others)
    context = Context(
        remainder,
        values.slight,
        [each.name for each in basis.refinements],
        judged.off_nominal,
        untestable,
        can_be_retuned(line),
        mismatch.element,
        None if seen is None else seen.element,
        doubts,
    )
    is_left = verdict is Verdict.UNEXPLAINED and judged.failed and not judged.off_nominal and line.plant is None
    said_of_law = law.said if law is not None else NO_LAW if is_left else ""
    return Diagnosis(
        verdict=verdict,
        statement=f"{statement(verdict, decision.figures, effects, basis.effort, context)} {said_of_law}".rstrip(),
        mismatch=mismatch,
        effects=effects,
        rejected=others,
        untestable=untestable,
        fit=decision.figures if law is None else law.fit,
        parameters=values.parameters,
        load_torque=values.loads,
        timing_s={},
        augmented=values.augmented,
        traces=courses if law is None else law.drawn(courses, judged.believed.hypothesis, runs),
        warnings=basis.warnings,
        doubts=doubts,
        discrepancy=seen,
        remainder=remainder,
        off_nominal=judged.off_nominal,
        slight=values.slight,
        refinements=tuple(
            Refinement(
                each.name, each.objection, each.necessity.value, judged.best.hypothesis.result.values_of(each.name)
            )
            for each in basis.refinements
        ),
        table=None if law is None else law.table,
        effort=basis.effort,
    )


class Values(NamedTuple):
    """What a result says in numbers: those that are reported with an interval are next to the names that are believed.

    The model that is written has a law without a name as well, and what the line is next to it.
    """

    named: Sequence[FoundEffect]  # effects that are believed, whatever the verdict
    added: tuple[FoundEffect, ...]  # those that the model has, faults of the acquisition among them
    slight: tuple[Slight, ...]  # traces
    augmented: DrivelineModel  # the model as it was given, and what was found
    parameters: Mapping[str, Retuned]  # of the line, by name
    loads: Mapping[str, Estimated]  # constant load torque of each recording


def _values(basis: Basis) -> Values:
    decision, fits, law = basis.decision, basis.search.fits, basis.law
    judged, runs, line = decision.judged, decision.runs, fits.model
    is_explained = decision.verdict is not Verdict.UNEXPLAINED
    traces, estimate = judged.traces if is_explained else (), estimate_of(runs.believed, runs.is_whole, runs.after)
    fit, covariance = estimate.fit, estimate.covariance
    named, noticed = ([found_effect(each, runs, estimate) for each in of] for of in (judged.named, traces))
    believed = judged.believed.hypothesis
    slighted = tuple(slight(each, believed, fits.without(believed, each.name).result) for each in traces)
    added = (*named, *decision.acquired) if is_explained else ()
    augmented = augmented_model(fit, covariance, basis.model, (*added, *noticed))
    if law is not None:
        augmented = law.augmented(augmented)
    parameters, loads = retuned_parameters(fit, covariance, line, is_explained), load_torques(fit, covariance, line)
    return Values(named, added, slighted, augmented, parameters, loads)


def _discrepancy(basis: Basis) -> Discrepancy | None:
    """Return where simulation and recordings differ, before and after; None where they do not, or nobody can tell."""
    judged, line, law = basis.decision.judged, basis.search.fits.model, basis.law
    if basis.decision.verdict is Verdict.NO_MISMATCH or line.plant is not None:
        return None
    before, after = (each.hypothesis.result.first_outputs() for each in (judged.nothing, judged.believed))
    return discrepancy(before, after if law is None else law.found.result, judged.noise, line.motion)


def _not_looked_at(basis: Basis, others: Sequence[RejectedEffect]) -> tuple[UntestableEffect, ...]:
    """Return the effects that the recordings cannot tell and that were not tried all the same.

    Behind a sensor that is blind for the sign more is tried than the recordings alone would tell.
    """
    judged = basis.decision.judged
    standings = (*judged.named, *judged.traces, *judged.refinements)
    tried = {other for each in standings for other in (each.name, *each.alike)} | {each.name for each in others}
    blind = open_hypotheses(basis.search.fits.model, basis.decision.runs.chain.records)[1]
    return untestable_effects({name: why for name, why in blind.items() if name not in tried})


def _as_sure_as(is_uncounted: bool, effects: tuple[FoundEffect, ...]) -> tuple[FoundEffect, ...]:
    """Return effects without how sure their names are where none were counted: with a doubt or a law without a name."""
    return tuple(replace(each, probability=math.nan, counted=None) for each in effects) if is_uncounted else effects


def undecided(
    fits: Fits | None,
    chain: Chain,
    line: DrivelineModel,
    model: DrivelineModel,
    work: Work,
    level: str,
    doubts: Sequence[Doubt] = (),
) -> Diagnosis:
    """Return the answer of a search that the limit of time has ended: nothing is decided, and nothing rejected."""
    names, blind = open_hypotheses(line, chain.records)
    nothing = None if fits is None else fits.ended.get(frozenset())
    parameters, loads, augmented = dict[str, Retuned](), dict[str, Estimated](), model
    try:
        fit, estimate = first_figures(chain, line, nothing)
        cov = reported_covariance(estimate)
        augmented = augmented_model(estimate, cov, model, ())
        parameters, loads = retuned_parameters(estimate, cov, line, False), load_torques(estimate, cov, line)
    except TimeIsUp:  # the whole limit, after which another program simulates no more
        fit = figures_without(chain, line, nothing)
    effort = effort_so_far(fits, names, work, level)
    untestable = untestable_effects(blind)
    context = Context(untestable=untestable, can_be_retuned=can_be_retuned(line), doubts=doubts)
    return Diagnosis(
        verdict=Verdict.UNEXPLAINED,
        statement=statement(Verdict.UNEXPLAINED, fit, (), effort, context),
        mismatch=Mismatch(True, None, {}, None, None, math.nan),
        effects=(),
        rejected=(),
        untestable=untestable,
        fit=fit,
        parameters=parameters,
        load_torque=loads,
        timing_s={},
        augmented=augmented,
        traces=(),
        effort=effort,
        doubts=tuple(doubts),
    )


def untestable_effects(blind: Mapping[str, Untestable]) -> tuple[UntestableEffect, ...]:
    """Return the effects that the recordings can't tell, with the reason and a test that could."""
    return tuple(UntestableEffect(n, u.reason, u.suggested_test, u.needs) for n, u in blind.items())


def _place(basis: Basis, seen: Discrepancy | None) -> Element | None:
    """Return where the mismatch is.

    At what is named, at the law without a name, at values off their sheet, at all that is possible, or else where an
    input alone would make the error most probable.
    """
    decision = basis.decision
    if decision.verdict is not Verdict.UNEXPLAINED and (decision.judged.named or decision.acquired):
        names = [each.name for each in decision.judged.named] + [each.name for each in decision.acquired]
        return EFFECTS[names[0]].element
    if basis.law is not None:
        return basis.law.table.element
    if decision.judged.off_nominal:
        return decision.judged.off_nominal[0].element
    possible = {EFFECTS[each.name].element for each in decision.judged.refinements}
    if len(possible) == 1:
        return possible.pop()
    return None if seen is None else seen.element


def _mismatch(basis: Basis, seen: Discrepancy | None) -> Mismatch:
    judged, noise = basis.decision.judged, basis.decision.judged.noise
    if basis.decision.verdict is Verdict.NO_MISMATCH:
        return Mismatch(False, None, {}, None, None, 1.0)
    nothing = judged.nothing.hypothesis
    result, element = nothing.result.first_outputs(), _place(basis, seen)
    gained = max(nothing.score - judged.best.hypothesis.score, 0.0)
    return Mismatch(
        detected=True,
        element=element,
        time_s=locate.intervals(result, noise),
        band_hz=locate.band_hz(result, noise),
        region=None if element is None else locate.region(result, element, noise, basis.model.motion),
        p_value=max(math.exp(-0.5 * gained), Noise.SMALLEST_P),
    )


def _remainder(decision: Decision, law: Law | None) -> Remainder | None:
    judged = decision.judged
    if not judged.failed:
        return None
    noise, left = judged.noise, judged.believed.rms
    return Remainder(
        share=min(max(left**2 - noise**2, 0.0) / judged.nothing.rms**2, 1.0),
        times_noise=decision.figures.augmented / noise,
        element=None if law is None else law.table.element,
        band_hz=locate.band_hz(judged.believed.hypothesis.result.first_outputs(), noise),
        law=tests_in_words(judged.failed) + ("" if law is None else f"; it follows a torque over {law.table.over}"),
    )


def tests_in_words(failed: Sequence[Test]) -> str:
    """Say what an error does that noise does not, as the end of a sentence that begins with "it"."""
    names = [test.name for test in failed]
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def effort_of(search: Search, level: str, decision: Decision) -> Effort:
    """Return what a search cost; ``untried`` is what looked worth a fit and had none."""
    fits, best = search.fits, decision.judged.believed.hypothesis.score
    settled = {*fits.implausible, *(name for effects in (*fits.ended, *fits.rough) for name in effects)}
    untried = tuple(name for name in fits.names if name not in settled and fits.foreseen.get(name, -math.inf) < best)
    sets = fitted_sets(fits, search.path, decision.judged)
    return Effort(level, fits.simulations, True, untried, len(fits.names), sets=sets)


def effort_so_far(fits: Fits | None, names: Sequence[str], work: Work, level: str) -> Effort:
    """Return what a search had cost when the limit of time ended it; without fits, it had not started."""
    if fits is None:
        return Effort(level, 0, False, tuple(names), len(names), work.limit_s)
    tried = {*fits.scores(), *fits.implausible}
    untried = tuple(name for name in names if name not in tried)
    return Effort(level, fits.simulations, False, untried, len(names), work.limit_s, fitted_sets(fits))


def warnings_of(search: Search, level: str) -> tuple[str, ...]:
    """Return what is to be said of a search that ended at its limit of simulations."""
    if not search.is_cut_short:
        return ()
    return (
        f"the search ended with the best set of effects so far, after the {Telling.LEVELS[level]:,} simulations of its "
        f"effort ({level}); further effects, and look-alikes of those named, were not tried. Try --effort thorough, or "
        "fewer recordings.",
    )


def fitted_sets(fits: Fits, way: Sequence[Hypothesis] = (), judged: Judged | None = None) -> tuple[FittedSet, ...]:
    """Return every set that was fitted, the smaller first, then the more probable: threads fit in any order."""
    steps = {each.effects for each in way}
    best = min((each.score for each in fits.ended.values()), default=math.nan)
    found = []
    for effects, before in list(fits.started_from.items()):
        fit = fits.ended.get(effects) or fits.rough.get(effects)
        trial = None if judged is None else judged.tried.get(effects)
        rms = math.nan if trial is None else trial.rms
        outcome = _outcome(effects, fits, steps, judged, rms)
        score = math.nan if fit is None else fit.score - best
        found.append(FittedSet(tuple(sorted(effects)), tuple(sorted(before)), score, rms, outcome))
    return tuple(sorted(found, key=lambda e: (len(e.effects), math.isnan(e.score), e.score, e.effects)))


def _outcome(effects: Effects, fits: Fits, steps: Set[Effects], judged: Judged | None, rms: float) -> str:
    if effects not in fits.ended and effects not in fits.rough:
        return "its values are no case of it"
    if judged is None:
        return "the limit of time came before it was judged"
    if effects == judged.believed.effects:
        return "believed"
    if effects == judged.best.effects:
        return "where the search ended; what of it is not established is a refinement"
    if effects in steps:
        return "on the way of the search"
    if rms > judged.believed.rms:
        return "simulates worse than what is believed"
    return "less probable" if effects in fits.ended else "left after a few steps: others promised more"


def rejected(
    fits: Fits, decision: Decision, refinements: Sequence[Standing], elsewhere: Set[str]
) -> tuple[RejectedEffect, ...]:
    """Return the rivals that lost, the nearest first, each with what was done and by how much it is worse.

    ``delta_bic`` is by how much the best set with a rival is less probable than the best of all: fitted, or as a score
    test foresees it at most. Effects that are listed ``elsewhere``, and look-alikes of a name, are not among them.
    """
    judged = decision.judged
    best = judged.believed.hypothesis.score
    standings = (*judged.named, *judged.traces, *judged.refinements)
    known = {each.name for each in standings} | {other for each in standings for other in each.alike}
    known |= {each.name for each in decision.acquired} | elsewhere
    found = {each.name: RejectedEffect(each.name, each.objection, 0.0) for each in refinements}
    for scores, reason in (
        (fits.scores(), "fitted: the best set with it is {}"),
        (fits.implausible, "fitted, and ended at values that are no case of it"),
        (fits.foreseen, "not fitted: a score test foresees that the best set with it is {} at best"),
    ):
        for name, score in sorted(scores.items(), key=lambda item: item[::-1]):  # not as cores came to their end
            if name not in found and name not in known:
                fitted = reason.format(compared(score - best))
                seen = _as_tried(name, judged.tried.values(), judged.believed)
                text = seen if seen and score < best else fitted
                found[name] = RejectedEffect(name, text, min(best - score, 0.0))
    return tuple(sorted(found.values(), key=lambda each: -each.delta_bic))


def _as_tried(name: str, tried: Iterable[Trial], believed: Trial) -> str:
    """Say what the best set with an effect leaves in the free run; "" where none was tried."""
    holding = [each for each in tried if name in each.effects]
    if not holding:
        return ""
    best = min(holding, key=lambda each: each.rms)
    count, of_believed = (f"{len(each.effects)} effect{'s' * (len(each.effects) != 1)}" for each in (best, believed))
    said = (
        f"tried: with {count} it leaves {best.rms / believed.rms:.3g} times the error of what is believed, with "
        f"{of_believed}, on samples not used for the fit"
    )
    if best.rms >= believed.rms:
        return said
    if best.clearly_beats(believed):
        return f"{said}: less, but not by enough to establish it"
    return f"{said}: less, but by no more than the scatter from block to block"
