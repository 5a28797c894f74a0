"""``diagnose`` by likelihood: recordings and a nominal model in, a verdict out, as ``estimator.diagnosis.diagnose``."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from estimator.diagnosis.assemble import acquired_effects, augmented_model, load_torques, retuned_parameters, rms_of
from estimator.diagnosis.chain import Chain, mechanical, read_through
from estimator.diagnosis.holdout import foreign_outputs
from estimator.diagnosis.hypotheses import NOTHING, Progress, everything, open_hypotheses, silent
from estimator.diagnosis.inference.disturbances import Size
from estimator.diagnosis.inference.effects import found_effects
from estimator.diagnosis.inference.free_run import Unseen, on_recordings
from estimator.diagnosis.inference.likelihood import Hypothesis
from estimator.diagnosis.inference.posterior import free_rms
from estimator.diagnosis.inference.search import Search
from estimator.diagnosis.inference.unnamed import Law, best_law, hunts_around, weighed_against
from estimator.diagnosis.inference.verdict import Decision, decide
from estimator.diagnosis.inference.wording import statement
from estimator.diagnosis.phrases import law_in_words
from estimator.diagnosis.preconditions import Prepared, prepare
from estimator.diagnosis.preconditions.thinned import as_slow_as_needed
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
    Trace,
    UnnamedLaw,
    UntestableEffect,
    Verdict,
)
from estimator.diagnosis.unnamed import Hunt
from estimator.diagnosis.where import discrepancy, locate
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult, fit
from estimator.physics.model import DrivelineModel, unit
from estimator.physics.problem import make_problem
from estimator.signals.record import FloatArray, OutputKind, Record

SMALLEST_P = 1e-300

BUDGET_S = 30.0
"""Time after which no further change of the best set is tried [s]."""

LOCATING_ROUNDS, LOOKING_ROUNDS = 6, 2
"""Rounds of the search for a law without a name: where nothing is named it locates the mismatch, else it says what is
left."""

DIMENSIONS = {OutputKind.SPEED: "speed", OutputKind.POSITION: "angle", OutputKind.FORCE: "torque"}


def diagnose(
    records: Sequence[Record],
    model: DrivelineModel,
    holdout: Sequence[Record] = (),
    progress: Progress = silent,
    budget_s: float = BUDGET_S,
) -> Diagnosis:
    """Find out whether physics is missing from a model, where, which, and how large it is.

    Parameters, result and errors are those of ``estimator.diagnosis.diagnose``. ``holdout`` takes no part in the
    decision, a likelihood counts each unknown's price; it is simulated with what was found, and the figures say how far
    that holds. ``budget_s`` is the time after which the best set of effects so far is the answer [s].
    """
    began = time.perf_counter()
    with threadpool_limits(1, user_api="blas"):  # on tall, thin matrices more threads only wait for each other
        progress("checking the recordings", 0.0)
        ready = prepare(records, model, holdout)
        return ready.finished(_diagnose(ready, model, progress, began, budget_s))


def _diagnose(ready: Prepared, model: DrivelineModel, progress: Progress, began: float, budget_s: float) -> Diagnosis:
    def is_over() -> bool:
        return time.perf_counter() - began > budget_s

    line, chain = mechanical(model), read_through(ready.records)
    unseen = Unseen(line, read_through(ready.holdout).records)
    names, untestable = open_hypotheses(line, chain.records)
    fitted_to = as_slow_as_needed(chain.records, line)
    progress("comparing hypotheses", 0.1)
    search = Search(line, fitted_to, everything(fitted_to), names, is_over=is_over)
    decision = decide(search, with_findings=bool(chain.findings))
    progress("looking at what is left", 0.8)
    seen = _looked_at(decision, is_over)
    decision = seen.decision
    progress("simulating what was found", 0.9)
    told = _told(seen, chain, line, unseen)
    effects = (*told.effects, *_acquired(chain, told.final))
    blind = tuple(UntestableEffect(n, u.reason, u.suggested_test, u.needs) for n, u in untestable.items())
    mismatch = _mismatch(seen, effects)
    remainder = _remainder(seen)
    progress("done", 1.0)
    return Diagnosis(
        verdict=decision.verdict,
        statement=statement(decision, effects, told.figures, blind, remainder),
        mismatch=mismatch,
        effects=effects,
        rejected=_rejected(search, decision),
        untestable=blind,
        unnamed=_unnamed(seen, told.figures),
        fit=told.figures,
        parameters=retuned_parameters(seen.believed.white, line, decision.verdict is not Verdict.UNEXPLAINED),
        load_torque=load_torques(seen.believed.white, line),
        timing_s={"total": time.perf_counter() - began},
        augmented=augmented_model(seen.believed.plain, model, effects),
        traces=_courses(chain, line, unseen, told, seen),
        warnings=(_stopped(search, budget_s),) if search.stopped else (),
        discrepancy=_discrepancy(seen, line) if mismatch.detected else None,
        remainder=remainder,
        slight=tuple(
            Slight(each.name, each.share, decision.best.plain.values_of(each.name)) for each in decision.traces
        ),
    )


@dataclass(frozen=True, slots=True)
class _Seen:
    """A decision, and the laws without a name around it.

    Attributes
    ----------
    believed : Hypothesis
        What the answer is of: the best set of effects where one of them is established, else the nominal model.
    hunts : list of Hunt
        The search for a law beside no effect at all; empty where it was not made.
    law : Law or None
        What is left beyond noise, as a law without a name.
    """

    decision: Decision
    believed: Hypothesis
    hunts: list[Hunt]
    law: Law | None


def _looked_at(decision: Decision, is_over: Callable[[], bool]) -> _Seen:
    """Weigh the names against a law without one, and look for the law of what is left, while there is time."""
    hunts: list[Hunt] = []
    if (decision.failed or decision.named) and not is_over():
        hunts = hunts_around(decision.nothing, LOOKING_ROUNDS if decision.named else LOCATING_ROUNDS)
        law = best_law(decision.nothing, hunts)
        decision = weighed_against(decision, law)
    if decision.named and decision.verdict is not Verdict.UNEXPLAINED:
        is_left = bool(decision.failed) and not is_over()
        law = best_law(decision.best, hunts_around(decision.best, LOOKING_ROUNDS)) if is_left else None
        return _Seen(decision, decision.best, hunts, law)
    return _Seen(decision, decision.nothing, hunts, best_law(decision.nothing, hunts) if hunts else None)


@dataclass(frozen=True, slots=True)
class _Told:
    """Free runs of what is believed, on the recordings at their own rate, with their figures."""

    retuned: FitResult
    final: FitResult
    figures: Fit
    effects: tuple[FoundEffect, ...]


def _told(seen: _Seen, chain: Chain, line: DrivelineModel, unseen: Unseen) -> _Told:
    nothing, believed = seen.decision.nothing, seen.believed
    retuned = on_recordings(nothing, line, chain.records)
    final = retuned if believed is nothing else on_recordings(believed, line, chain.records)
    held_before = unseen.rms(nothing, retuned)
    held_after = held_before if believed is nothing else unseen.rms(believed, final)
    as_read = fit(replace(retuned.problem, records=chain.raw), retuned.x) if chain.findings else retuned
    figures = Fit(
        unit=unit(DIMENSIONS[chain.raw[0].kind], line.motion),
        nominal=fit(make_problem(line, chain.raw, (), grid=retuned.problem.grid)).rms,
        retuned=as_read.rms,
        augmented=rms_of(chain.errors(final.outputs)),
        holdout_retuned=held_before,
        holdout_augmented=held_after,
        noise_floor=noise_of(seen.decision.best),
    )
    found = found_effects(seen.decision, line) if believed is not nothing else ()
    effects = tuple(
        replace(each, evidence=replace(each.evidence, holdout_rms_before=held_before, holdout_rms_after=held_after))
        for each in found
    )
    return _Told(retuned, final, figures, effects)


def _acquired(chain: Chain, final: FitResult) -> tuple[FoundEffect, ...]:
    before = [(out - raw.output)[raw.okay] for out, raw in zip(final.outputs, chain.raw, strict=True)]
    return acquired_effects(chain, before, chain.errors(final.outputs))


def _stopped(search: Search, budget_s: float) -> str:
    untried = sorted({*search.names} - {*search.rivals} - {name for effects in search.visited for name in effects})
    fitted = f"; no fit was made of {', '.join(untried)}" if untried else ""
    return (
        f"the search ended after its {budget_s:g} s with the best set of effects so far: not tried were further "
        f"effects on top of it, and look-alikes in the place of those named{fitted}. Give it more time (--budget-s), "
        "or fewer or shorter recordings."
    )


def noise_of(hypothesis: Hypothesis) -> float:
    """Return the reading's noise, white and coloured [unit of the output]."""
    return float(np.hypot(*np.exp(hypothesis.sizes[[Size.WHITE, Size.COLOURED]])))


def _errors(hypothesis: Hypothesis) -> list[FloatArray]:
    """Return the free-run error per recording, 0 where a sample is missing."""
    plain = hypothesis.plain
    return [np.where(r.okay, r.output - out, 0.0) for r, out in zip(plain.problem.records, plain.outputs, strict=True)]


def _band_hz(hypothesis: Hypothesis, noise: float) -> Interval | None:
    periods = [record.sample_time_s for record in hypothesis.plain.problem.records]
    return locate.band_hz(_errors(hypothesis), periods, noise)


def _mismatch(seen: _Seen, effects: Sequence[FoundEffect]) -> Mismatch:
    decision = seen.decision
    if decision.verdict is Verdict.NO_MISMATCH:
        return Mismatch(False, None, {}, None, None, 1.0)
    nothing, noise = decision.nothing.plain, noise_of(decision.best)
    law = None if seen.law is None else seen.law.element
    element: Element | None = effects[0].element if effects else law
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
    nothing = seen.decision.nothing
    noise = noise_of(seen.decision.best)
    return discrepancy(
        nothing.plain, seen.believed.plain, noise, line.motion, rounds=1, begun=seen.hunts, whitening=nothing.filter
    )


def _rejected(search: Search, decision: Decision) -> tuple[RejectedEffect, ...]:
    """Return what else was fitted, and by how much the best set with it is less probable than the best of all."""
    named = {each.name for each in (*decision.named, *decision.traces)}
    return tuple(
        RejectedEffect(
            name,
            "the recordings are less probable with it in the place of, or beside, what was chosen",
            decision.best.score - score if name not in decision.best.effects else 0.0,
        )
        for name, score in sorted(search.rivals.items(), key=lambda item: item[1])
        if name not in named
    )


def _remainder(seen: _Seen) -> Remainder | None:
    """Return what is left beyond noise and drift; None where nothing is."""
    decision, believed, law = seen.decision, seen.believed, seen.law
    if not decision.failed:
        return None
    noise, left = noise_of(decision.best), free_rms(believed)
    said = law_in_words(law.terms) if law is not None else "; ".join(test.name for test in decision.failed)
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


def _courses(chain: Chain, line: DrivelineModel, unseen: Unseen, told: _Told, seen: _Seen) -> tuple[Trace, ...]:
    """Return the simulations of every recording, for plots; those kept out of the fit last."""
    grid = told.retuned.problem.grid

    def nominal(records: Sequence[Record]) -> tuple[FloatArray, ...]:
        return fit(make_problem(line, records, (), grid=grid)).outputs

    seen_runs = (nominal(chain.records), told.retuned.outputs, told.final.outputs)
    traces = [_trace(record, runs, False) for record, *runs in zip(chain.raw, *seen_runs, strict=True)]
    if unseen.records:
        use = everything(unseen.records)
        foreign_runs = (
            nominal(unseen.records),
            foreign_outputs(told.retuned, line, unseen.records, use, NOTHING),
            foreign_outputs(told.final, line, unseen.records, use, seen.believed.effects),
        )
        traces += [_trace(record, runs, True) for record, *runs in zip(unseen.records, *foreign_runs, strict=True)]
    return tuple(traces)


def _trace(r: Record, runs: Sequence[FloatArray], holdout: bool) -> Trace:
    nominal, retuned, augmented = runs
    return Trace(r.name, r.time_s, r.torque_nm, r.output, r.okay, nominal, retuned, augmented, holdout)
