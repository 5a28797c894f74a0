"""``diagnose``: recordings and a nominal model in, a verdict out."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
from threadpoolctl import threadpool_limits

from estimator.diagnosis import locate
from estimator.diagnosis.assemble import augmented_model, found_effects, load_torques, retuned_parameters
from estimator.diagnosis.evidence import gain, residuals_by_record
from estimator.diagnosis.holdout import Examiner, foreign_outputs
from estimator.diagnosis.hypotheses import NOTHING, Bench, Progress, everything, open_hypotheses
from estimator.diagnosis.judgement import Judgement, judge
from estimator.diagnosis.noise import noise_floor, unpredictable
from estimator.diagnosis.preconditions import check
from estimator.diagnosis.result import (
    Diagnosis,
    Fit,
    Mismatch,
    RejectedEffect,
    Trace,
    UnnamedLaw,
    UntestableEffect,
    Verdict,
)
from estimator.diagnosis.selection import Selection, Selector
from estimator.diagnosis.wording import rejection, statement
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.fit import fit, make_problem
from estimator.physics.model import DrivelineModel, unit
from estimator.signals.record import FloatArray, OutputKind, Record


def _silent(_message: str, _share: float) -> None:
    """Report nothing."""


def diagnose(
    records: Sequence[Record],
    model: DrivelineModel,
    holdout: Sequence[Record] = (),
    progress: Progress = _silent,
) -> Diagnosis:
    """Find out whether physics is missing from a model, where, which, and how large it is.

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
    """
    with threadpool_limits(1, user_api="blas"):  # on tall, thin matrices more threads only wait for each other
        return _diagnose(records, model, holdout, progress)


def _diagnose(
    records: Sequence[Record], model: DrivelineModel, holdout: Sequence[Record], progress: Progress
) -> Diagnosis:
    began = time.perf_counter()
    check(records, model, holdout)
    progress("fitting the nominal model", 0.0)
    floor = noise_floor(records)
    names, untestable = open_hypotheses(model, records)
    bench = Bench(model, records, everything(records))
    examiner = Examiner(model, records, holdout)
    selection = Selector(bench, examiner, names, floor, progress).run()
    progress("weighing the verdict", 0.9)
    judgement = judge(selection, floor)
    believed = judgement.verdict is Verdict.EXPLAINED
    final = selection.result if believed else selection.retuned
    figures = _fit_figures(selection, examiner, model, floor, believed)
    effects = found_effects(selection, model, examiner) if believed else ()
    blind = tuple(UntestableEffect(n, u.reason, u.suggested_test) for n, u in untestable.items())
    progress("done", 1.0)
    return Diagnosis(
        verdict=judgement.verdict,
        statement=statement(judgement, effects, figures, blind),
        mismatch=_mismatch(selection, judgement, floor),
        effects=effects,
        rejected=_rejected(selection, believed, judgement),
        untestable=blind,
        unnamed=_unnamed(selection, judgement),
        fit=figures,
        parameters=retuned_parameters(final, model),
        load_torque=load_torques(final, model),
        timing_s={"total": time.perf_counter() - began},
        augmented=augmented_model(final, model, effects),
        traces=_traces(selection, model, holdout, believed),
    )


def _fit_figures(selection: Selection, examiner: Examiner, model: DrivelineModel, floor: float, believed: bool) -> Fit:
    records = selection.retuned.problem.records
    dimension = "speed" if records[0].kind is OutputKind.SPEED else "angle"
    nominal = fit(make_problem(model, records, (), grid=selection.retuned.problem.grid))
    chosen = selection.chosen if believed else NOTHING
    final = selection.result if believed else selection.retuned
    held = examiner.compare(selection.retuned, NOTHING, final, chosen)
    return Fit(
        unit=unit(dimension, model.motion),
        nominal=nominal.rms,
        retuned=selection.retuned.rms,
        augmented=final.rms,
        holdout_retuned=held.before,
        holdout_augmented=held.after,
        noise_floor=_floor(selection, floor),
    )


def _floor(selection: Selection, floor: float) -> float:
    """Return the lower of the two estimates of the noise: of the reading, and of the best explanation's error."""
    return min(floor, unpredictable(residuals_by_record(selection.result)))


def _mismatch(selection: Selection, judgement: Judgement, floor: float) -> Mismatch:
    floor = _floor(selection, floor)
    if judgement.verdict is Verdict.NO_MISMATCH:
        return Mismatch(False, None, {}, None, None, 1.0)
    element = _element(selection, judgement)
    p_value = judgement.unnamed.gain.p_value if judgement.unnamed is not None else 1.0
    if selection.chosen:
        p_value = min(p_value, gain(selection.retuned, selection.result).p_value)
    return Mismatch(
        detected=True,
        element=element,
        time_s=locate.intervals(selection.retuned, floor),
        band_hz=locate.band_hz(selection.retuned, floor),
        region=None if element is None else locate.region(selection.retuned, element),
        p_value=p_value,
    )


def _element(selection: Selection, judgement: Judgement) -> Element | None:
    """Return where the mismatch is: at the strongest effect, or where the best law without a name acts."""
    if judgement.verdict is Verdict.EXPLAINED or judgement.unnamed is None:
        trials = selection.accepted.values()
        strongest = max(trials, key=lambda trial: trial.gain.delta_bic, default=None)
        return None if strongest is None else EFFECTS[strongest.name].element
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
    final = selection.result
    rivals = []
    for name, trial in selection.trials.items():
        if name in selection.chosen:
            if not believed:
                rivals.append(RejectedEffect(name, judgement.objection, 0.0))
            continue
        delta = (
            trial.gain.delta_bic - gain(selection.retuned, final).delta_bic
            if selection.chosen
            else trial.gain.delta_bic
        )
        rivals.append(RejectedEffect(name, rejection(trial, selection), delta))
    return tuple(sorted(rivals, key=lambda rival: -rival.delta_bic))


def _traces(
    selection: Selection, model: DrivelineModel, holdout: Sequence[Record], believed: bool
) -> tuple[Trace, ...]:
    records = selection.retuned.problem.records
    grid = selection.retuned.problem.grid
    nominal = fit(make_problem(model, records, (), grid=grid)).outputs
    final = selection.result if believed else selection.retuned
    traces = [
        _trace(record, simulated, False)
        for record, *simulated in zip(records, nominal, selection.retuned.outputs, final.outputs, strict=True)
    ]
    if holdout:
        use = everything(holdout)
        profile = believed and any(EFFECTS[name].profile for name in selection.chosen)
        runs = (
            fit(make_problem(model, holdout, (), grid=grid)).outputs,
            foreign_outputs(selection.retuned, model, holdout, use, False),
            foreign_outputs(final, model, holdout, use, profile),
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
