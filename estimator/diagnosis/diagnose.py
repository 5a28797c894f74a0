"""``diagnose``: recordings and a nominal model in, a verdict out."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from estimator.diagnosis.assemble import (
    acquired_effects,
    augmented_model,
    found_effects,
    load_torques,
    retuned_parameters,
    rms_of,
)
from estimator.diagnosis.bench import Bench
from estimator.diagnosis.chain import Chain, mechanical, read_through
from estimator.diagnosis.evidence import Gain, gain, information, noise_level, residuals_by_record
from estimator.diagnosis.first_use import COMPILING, compile_kernels, is_first_use
from estimator.diagnosis.holdout import Examiner, foreign_outputs
from estimator.diagnosis.hypotheses import NOTHING, Progress, effects_of, everything, silent
from estimator.diagnosis.judgement import Judgement, judge
from estimator.diagnosis.preconditions import prepare
from estimator.diagnosis.result import (
    Diagnosis,
    Discrepancy,
    Fit,
    FoundEffect,
    Interval,
    Mismatch,
    RejectedEffect,
    Trace,
    UnnamedLaw,
    UntestableEffect,
    Verdict,
)
from estimator.diagnosis.search import search
from estimator.diagnosis.selection import Selection
from estimator.diagnosis.unnamed import UnnamedLaw as Nameless
from estimator.diagnosis.where import discrepancy, locate
from estimator.diagnosis.wording import rejection, statement
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult, fit
from estimator.physics.model import DrivelineModel, unit
from estimator.physics.problem import make_problem
from estimator.signals.record import FloatArray, OutputKind, Record


def diagnose(
    records: Sequence[Record],
    model: DrivelineModel,
    holdout: Sequence[Record] = (),
    progress: Progress = silent,
) -> Diagnosis:
    """Find out whether physics is missing from a model, where, which, and how large it is.

    The first call on a machine compiles the simulation, in two processes, and keeps it on disk.

    Parameters
    ----------
    records : sequence of Record
        Recordings to explain, of one sampling period.
    model : DrivelineModel
        Nominal model with the tolerances its parameters are trusted to; effects it has stay as they are.
    holdout : sequence of Record, optional
        Recordings on which explanations are judged; without them stretches of ``records`` are kept out of the fit.
    progress : callable, optional
        Called with a message and the share of work done; an exception it raises cancels the diagnosis.

    Returns
    -------
    Diagnosis
        The fields of the contract's ``diagnosis.json``, the augmented model, and simulations for plots.

    Raises
    ------
    NotExciting
        Where the recordings are too short, constant or otherwise determine nothing.
    BadShape
        Where recordings do not belong together.
    Implausible
        Where torque, output or time is off by a factor or in sign.
    """
    began = time.perf_counter()
    if is_first_use():
        progress = _telling(progress)
        progress("preparing", 0.0)
        compile_kernels()
    with threadpool_limits(1, user_api="blas"):  # on tall, thin matrices more threads only wait for each other
        progress("checking the recordings", 0.0)
        ready = prepare(records, model, holdout)
        return ready.finished(_diagnose(ready.records, model, ready.holdout, progress, began))


def _telling(progress: Progress) -> Progress:
    """Say at every stage what most of its time goes to."""
    return lambda message, share: progress(f"{message} ({COMPILING})", share)


def _diagnose(
    records: Sequence[Record], model: DrivelineModel, holdout: Sequence[Record], progress: Progress, began: float
) -> Diagnosis:
    progress("fitting the nominal model", 0.0)
    line = mechanical(model)
    chain, unseen = read_through(records), read_through(holdout)
    found = search(chain, line, unseen.records, progress)
    chain, examiner, selection, floor = found.chain, found.jury.examiner, found.selection, found.jury.weight.floor
    progress("weighing the verdict", 0.9)
    judgement = judge(selection, floor, chain.findings)
    believed = judgement.verdict is Verdict.EXPLAINED
    final = selection.result if believed else selection.retuned
    seen = None
    if judgement.verdict is not Verdict.NO_MISMATCH:
        level = noise_level(selection.result, floor)
        seen = discrepancy(selection.retuned, final, level, line.motion, begun=selection.hunts)
        judgement = _located(judgement, seen)
    before = _raw_fit(chain, line, final)
    retuned = _raw_fit(chain, line, selection.retuned)
    figures = _fit_figures(chain, retuned, selection, examiner, line, floor, believed)
    acquired = acquired_effects(chain, residuals_by_record(before), chain.errors(final.outputs))
    effects = (*(found_effects(selection, line, examiner) if believed else ()), *acquired)
    blind = tuple(UntestableEffect(n, u.reason, u.suggested_test, u.needs) for n, u in found.untestable.items())
    progress("done", 1.0)
    return Diagnosis(
        verdict=judgement.verdict,
        statement=statement(judgement, effects, figures, blind),
        mismatch=_mismatch(selection, judgement, floor, effects, None if chain.findings else final, retuned),
        effects=effects,
        rejected=_rejected(selection, believed, judgement),
        untestable=blind,
        unnamed=_unnamed(selection, judgement),
        fit=figures,
        parameters=retuned_parameters(final, line, judgement.verdict is not Verdict.UNEXPLAINED),
        load_torque=load_torques(final, line),
        timing_s={"total": time.perf_counter() - began},
        augmented=augmented_model(final, model, effects),
        traces=_traces(chain, selection, line, unseen.records, believed),
        warnings=judgement.unconverged,
        discrepancy=seen,
        strays=judgement.strays,
    )


def _located(judgement: Judgement, seen: Discrepancy) -> Judgement:
    """Return an abstention with the law that was looked for in all rounds: the first can name the wrong place."""
    if judgement.verdict is not Verdict.UNEXPLAINED or not seen.laws:
        return judgement
    best = seen.laws[0]
    law = Nameless(best.element, best.terms, Gain(best.delta_bic, best.p_value, math.nan), best.rms)
    return replace(judgement, unnamed=law)


def _raw_fit(chain: Chain, model: DrivelineModel, result: FitResult) -> FitResult:
    """Return the fit of a hypothesis to the recordings as they were read, faults of the acquisition and all."""
    if not chain.findings:
        return result
    return Bench(model, chain.raw, everything(chain.raw), result.problem.grid).fit(effects_of(result), result)


def _fit_figures(
    chain: Chain,
    retuned: FitResult,
    selection: Selection,
    examiner: Examiner,
    model: DrivelineModel,
    floor: float,
    believed: bool,
) -> Fit:
    records = chain.raw
    dimension = {OutputKind.SPEED: "speed", OutputKind.POSITION: "angle", OutputKind.FORCE: "torque"}[records[0].kind]
    nominal = fit(make_problem(model, records, (), grid=selection.retuned.problem.grid))
    chosen = selection.chosen if believed else NOTHING
    final = selection.result if believed else selection.retuned
    held = examiner.compare(selection.retuned, NOTHING, final, chosen)
    return Fit(
        unit=unit(dimension, model.motion),
        nominal=nominal.rms,
        retuned=retuned.rms,
        augmented=rms_of(chain.errors(final.outputs)),
        holdout_retuned=held.before,
        holdout_augmented=held.after,
        noise_floor=noise_level(selection.result, floor),
    )


def _mismatch(
    selection: Selection,
    judgement: Judgement,
    floor: float,
    effects: Sequence[FoundEffect],
    explained: FitResult | None,
    retuned: FitResult,
) -> Mismatch:
    """Return what is missing where.

    ``explained`` is the fit that is believed, None where the acquisition's own faults are part of what it explains;
    ``retuned`` that of the nominal model to the recordings as they were read.
    """
    floor = noise_level(selection.result, floor)
    if judgement.verdict is Verdict.NO_MISMATCH:
        return Mismatch(False, None, {}, None, None, 1.0)
    element = _element(selection, judgement, effects)
    p_value = judgement.unnamed.gain.p_value if judgement.unnamed is not None else 1.0
    if selection.chosen:
        p_value = min(p_value, gain(selection.retuned, selection.result).p_value)
    p_value = min([p_value, *(effect.evidence.p_value for effect in effects)])
    return Mismatch(
        detected=True,
        element=element,
        time_s=locate.intervals(selection.retuned, floor),
        band_hz=_band(judgement, explained, retuned, floor),
        region=None if element is None else locate.region(selection.retuned, element, floor),
        p_value=p_value,
    )


def _band(judgement: Judgement, explained: FitResult | None, retuned: FitResult, floor: float) -> Interval | None:
    """Return the band of what the explanation moves, which no noise blurs; else that of the error above the noise."""
    records = retuned.problem.records
    moved = explained.outputs if judgement.verdict is Verdict.EXPLAINED and explained is not None else None
    other = [record.output for record in records] if moved is None else moved
    mismatch = [
        np.where(record.okay, output - mine, 0.0)
        for record, output, mine in zip(records, retuned.outputs, other, strict=True)
    ]
    return locate.band_hz(mismatch, [record.sample_time_s for record in records], floor if moved is None else 0.0)


def _element(selection: Selection, judgement: Judgement, effects: Sequence[FoundEffect]) -> Element | None:
    """Return where the mismatch is: at the strongest effect, or where the best law without a name acts."""
    if judgement.strays:
        return judgement.strays[0].element
    if judgement.verdict is Verdict.EXPLAINED or judgement.unnamed is None:
        strongest = max(effects, key=lambda effect: effect.evidence.delta_bic, default=None)
        return None if strongest is None else strongest.element
    return judgement.unnamed.element


def _unnamed(selection: Selection, judgement: Judgement) -> UnnamedLaw | None:
    """Return the law without a name, of the whole mismatch or else of what rejected effects leave."""
    if judgement.verdict is not Verdict.UNEXPLAINED:
        return None
    for law, before in ((judgement.unnamed, selection.retuned), (judgement.remaining, selection.result)):
        if law is not None:
            return UnnamedLaw(law.element, law.terms, before.rms, law.rms)
    return None


def _rejected(selection: Selection, believed: bool, judgement: Judgement) -> tuple[RejectedEffect, ...]:
    """Return the rivals and why each lost; their information is counted from what was chosen, with one n for all."""
    retuned, final = selection.retuned, selection.result
    n = gain(retuned, final).n_effective
    rivals = []
    for name, trial in selection.trials.items():
        if name in selection.chosen:
            if not believed:
                rivals.append(RejectedEffect(name, judgement.objection, 0.0))
            continue
        rivals.append(RejectedEffect(name, rejection(trial, selection), information(final, trial.result, n)))
    for name, share in selection.dismissed.items():
        if name not in selection.trials:
            reason = f"a first look explains {share:.0%} of the error: too little next to others for a fit"
            rivals.append(RejectedEffect(name, reason, information(final, retuned, n)))
    return tuple(sorted(rivals, key=lambda rival: -rival.delta_bic))


def _traces(
    chain: Chain, selection: Selection, model: DrivelineModel, holdout: Sequence[Record], believed: bool
) -> tuple[Trace, ...]:
    grid = selection.retuned.problem.grid
    nominal = fit(make_problem(model, chain.records, (), grid=grid)).outputs
    final = selection.result if believed else selection.retuned
    traces = [
        _trace(record, simulated, False)
        for record, *simulated in zip(chain.raw, nominal, selection.retuned.outputs, final.outputs, strict=True)
    ]
    if holdout:
        use = everything(holdout)
        chosen = selection.chosen if believed else NOTHING
        runs = (
            fit(make_problem(model, holdout, (), grid=grid)).outputs,
            foreign_outputs(selection.retuned, model, holdout, use, NOTHING),
            foreign_outputs(final, model, holdout, use, chosen),
        )
        traces += [_trace(record, simulated, True) for record, *simulated in zip(holdout, *runs, strict=True)]
    return tuple(traces)


def _trace(record: Record, simulated: Sequence[FloatArray], holdout: bool) -> Trace:
    nominal, retuned, augmented = (np.asarray(output) for output in simulated)
    return Trace(
        record.name,
        record.time_s,
        record.torque_nm,
        record.output,
        record.okay,
        nominal,
        retuned,
        augmented,
        holdout,
    )
