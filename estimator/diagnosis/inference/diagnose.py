"""``diagnose`` by likelihood: recordings and a nominal model in, a verdict out, as ``estimator.diagnosis.diagnose``."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from estimator.diagnosis.assemble import acquired_effects, augmented_model, load_torques, retuned_parameters
from estimator.diagnosis.chain import Chain, mechanical, read_through
from estimator.diagnosis.hypotheses import Progress, everything, open_hypotheses
from estimator.diagnosis.inference.disturbances import Size
from estimator.diagnosis.inference.effects import found_effects
from estimator.diagnosis.inference.likelihood import Hypothesis
from estimator.diagnosis.inference.posterior import free_rms
from estimator.diagnosis.inference.search import Search
from estimator.diagnosis.inference.verdict import Decision, decide
from estimator.diagnosis.inference.wording import statement
from estimator.diagnosis.preconditions import prepare
from estimator.diagnosis.preconditions.thinned import as_slow_as_needed
from estimator.diagnosis.result import (
    Diagnosis,
    Discrepancy,
    Fit,
    FoundEffect,
    Mismatch,
    RejectedEffect,
    Remainder,
    Slight,
    Trace,
    UntestableEffect,
    Verdict,
)
from estimator.diagnosis.where import discrepancy, locate
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult, not_fitted
from estimator.physics.model import DrivelineModel, unit
from estimator.physics.problem import make_problem, start_vector
from estimator.physics.starts import warm_start
from estimator.signals.record import OutputKind, Record

SMALLEST_P = 1e-300

BUDGET_S = 30.0
"""Time after which no further change of the best set is tried [s]."""

STOPPED = (
    f"the search was stopped after {BUDGET_S:g} s with the best set of effects so far: further effects on top of it, "
    "and look-alikes in the place of those named, were not tried"
)

DIMENSIONS = {OutputKind.SPEED: "speed", OutputKind.POSITION: "angle", OutputKind.FORCE: "torque"}


def _silent(_message: str, _share: float) -> None:
    """Report nothing."""


def diagnose(
    records: Sequence[Record],
    model: DrivelineModel,
    holdout: Sequence[Record] = (),
    progress: Progress = _silent,
) -> Diagnosis:
    """Find out whether physics is missing from a model, where, which, and how large it is.

    Parameters, result and errors are those of ``estimator.diagnosis.diagnose``. ``holdout`` judges nothing here: a
    likelihood counts each unknown's price.
    """
    began = time.perf_counter()
    with threadpool_limits(1, user_api="blas"):  # on tall, thin matrices more threads only wait for each other
        progress("checking the recordings", 0.0)
        ready = prepare(records, model, holdout)
        return ready.finished(_diagnose(ready.records, model, progress, began))


def _diagnose(records: Sequence[Record], model: DrivelineModel, progress: Progress, began: float) -> Diagnosis:
    line, chain = mechanical(model), read_through(records)
    names, untestable = open_hypotheses(line, chain.records)
    fitted_to = as_slow_as_needed(chain.records, line)
    progress("comparing hypotheses", 0.1)
    search = Search(
        line, fitted_to, everything(fitted_to), names, is_over=lambda: time.perf_counter() - began > BUDGET_S
    )
    decision = decide(search, with_findings=bool(chain.findings))
    progress("writing the verdict", 0.9)
    named = decision.verdict in (Verdict.EXPLAINED, Verdict.PARTLY_EXPLAINED)
    believed = decision.best if named and decision.named else decision.nothing
    full = {id(each): _on(chain.records, each, line) for each in (decision.nothing, believed)}
    retuned, final = full[id(decision.nothing)], full[id(believed)]
    found = found_effects(decision, line) if named else ()
    before = [(out - raw.output)[raw.okay] for out, raw in zip(final.outputs, chain.raw, strict=True)]
    acquired = acquired_effects(chain, before, chain.errors(final.outputs))
    effects = (*found, *acquired)
    figures = _figures(decision, believed, line, fitted_to)
    blind = tuple(UntestableEffect(n, u.reason, u.suggested_test, u.needs) for n, u in untestable.items())
    mismatch = _mismatch(decision, effects, believed)
    return Diagnosis(
        verdict=decision.verdict,
        statement=statement(decision, effects, figures, blind),
        mismatch=mismatch,
        effects=effects,
        rejected=_rejected(search, decision),
        untestable=blind,
        unnamed=None,
        fit=figures,
        parameters=retuned_parameters(believed.white, line, decision.verdict is not Verdict.UNEXPLAINED),
        load_torque=load_torques(believed.white, line),
        timing_s={"total": time.perf_counter() - began},
        augmented=augmented_model(believed.plain, model, effects),
        traces=_courses(chain, line, retuned, final),
        warnings=(STOPPED,) if search.stopped else (),
        discrepancy=_seen(decision, believed, line) if mismatch.detected else None,
        remainder=_remainder(decision),
        slight=tuple(
            Slight(each.name, each.share, decision.best.plain.values_of(each.name)) for each in decision.traces
        ),
    )


def _on(records: Sequence[Record], hypothesis: Hypothesis, line: DrivelineModel) -> FitResult:
    """Return the free run of a hypothesis on recordings at their own rate."""
    of = hypothesis.plain.problem
    problem = make_problem(
        line, records, of.shared, own=[basis.own for basis in of.local], use=[record.okay for record in records]
    )
    return not_fitted(problem, warm_start(problem, hypothesis.plain))


def _figures(decision: Decision, believed: Hypothesis, line: DrivelineModel, records: Sequence[Record]) -> Fit:
    problem = make_problem(line, records, ())
    nominal = replace(decision.nothing, plain=not_fitted(problem, start_vector(problem)))
    retuned, augmented = free_rms(decision.nothing), free_rms(believed)
    return Fit(
        unit=unit(DIMENSIONS[records[0].kind], line.motion),
        nominal=free_rms(nominal),
        retuned=retuned,
        augmented=augmented,
        holdout_retuned=retuned,
        holdout_augmented=augmented,
        noise_floor=noise_of(decision.best),
    )


def noise_of(hypothesis: Hypothesis) -> float:
    """Return the reading's noise, white and coloured [unit of the output]."""
    return float(np.hypot(*np.exp(hypothesis.sizes[[Size.WHITE, Size.COLOURED]])))


def _mismatch(decision: Decision, effects: Sequence[FoundEffect], believed: Hypothesis) -> Mismatch:
    if decision.verdict is Verdict.NO_MISMATCH:
        return Mismatch(False, None, {}, None, None, 1.0)
    nothing, noise = decision.nothing.plain, noise_of(decision.best)
    element: Element | None = effects[0].element if effects else None
    records = nothing.problem.records
    moved = [np.where(r.okay, r.output - out, 0.0) for r, out in zip(records, nothing.outputs, strict=True)]
    gained = max(decision.nothing.score - decision.best.score, 0.0)
    return Mismatch(
        detected=True,
        element=element,
        time_s=locate.intervals(nothing, noise),
        band_hz=locate.band_hz(moved, [record.sample_time_s for record in records], noise),
        region=None if element is None else locate.region(nothing, element, noise),
        p_value=max(math.exp(-0.5 * gained), SMALLEST_P),
    )


def _seen(decision: Decision, believed: Hypothesis, line: DrivelineModel) -> Discrepancy:
    """Return the mismatch as the report draws it."""
    return discrepancy(decision.nothing.plain, believed.plain, noise_of(decision.best), line.motion, rounds=1)


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


def _remainder(decision: Decision) -> Remainder | None:
    """Return what is left beyond noise and drift; None where nothing is."""
    if not decision.failed:
        return None
    return Remainder(decision.left, decision.times_noise, None, None, "; ".join(test.name for test in decision.failed))


def _courses(chain: Chain, line: DrivelineModel, retuned: FitResult, final: FitResult) -> tuple[Trace, ...]:
    problem = make_problem(line, chain.records, (), grid=retuned.problem.grid)
    nominal = not_fitted(problem, start_vector(problem)).outputs
    return tuple(
        Trace(r.name, r.time_s, r.torque_nm, r.output, r.okay, given, tuned, augmented, False)
        for r, given, tuned, augmented in zip(chain.raw, nominal, retuned.outputs, final.outputs, strict=True)
    )
