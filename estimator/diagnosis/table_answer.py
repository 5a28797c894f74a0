"""A law without a name in the answer: in the augmented model, figures and statement, where it makes these better.

It is called with a finished diagnosis, and changes nothing in it but what the law changes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from estimator.diagnosis.inference.figures import FreeRuns, Unseen, foreign_outputs, on_recordings
from estimator.diagnosis.inference.hypotheses import Hypothesis, all_good_samples
from estimator.diagnosis.result import Diagnosis, Trace, UnnamedTable, Verdict
from estimator.diagnosis.tables import TableFit, best_table
from estimator.physics.fit import FitResult
from estimator.physics.model import DrivelineModel, EffectValue, Motion, unit
from estimator.physics.tables import PLACES


def with_law(diagnosis: Diagnosis, believed: Hypothesis, runs: FreeRuns) -> Diagnosis:
    """Return a diagnosis with the best law without a name next to what is believed; as it is where none is better."""
    if diagnosis.verdict not in (Verdict.UNEXPLAINED, Verdict.PARTLY_EXPLAINED) or not diagnosis.effort.finished:
        return diagnosis
    line, kept_out = runs.unseen.line, runs.unseen.chain.records
    law = best_table(believed, line, kept_out)
    if law is None:
        return diagnosis
    tabled = _with_table(line, law)
    with_it = replace(believed, result=law.result)
    after = on_recordings(with_it, tabled, runs.chain.separated, is_whole=False)
    held = Unseen(tabled, runs.unseen.chain).rms(with_it, after, False, runs.chain, is_as_read=True)
    final = after.first_outputs()
    if final.rms >= diagnosis.fit.augmented or held >= diagnosis.fit.holdout_augmented:
        return diagnosis
    table = _diagnosis_of(law, diagnosis.augmented.motion)
    fit = replace(diagnosis.fit, augmented=final.rms, holdout_augmented=held)
    return replace(
        diagnosis,
        fit=fit,
        statement=f"{diagnosis.statement} {_sentences(table, fit.unit)}",
        augmented=_augmented(diagnosis.augmented, law, final),
        traces=_drawn(diagnosis.traces, believed, runs, tabled, final),
        table=table,
    )


def _with_table(model: DrivelineModel, law: TableFit) -> DrivelineModel:
    return replace(model, effects={**model.effects, law.table.name: law.table.effect()})


def _augmented(model: DrivelineModel, law: TableFit, final: FitResult) -> DrivelineModel:
    """Return the model with the law, and the line and its effects as they are next to it."""
    of_line = final.values_of("")
    parameters = {name: replace(p, value=of_line.get(name, p.value)) for name, p in model.parameters.items()}
    effects: dict[str, Mapping[str, EffectValue]] = {}
    for name, values in model.effects.items():
        found = final.values_of(name)
        effects[name] = {key: _moved(value, found.get(key, value.value)) for key, value in values.items()}
    return _with_table(replace(model, parameters=parameters, effects=effects), law)


def _moved(entry: EffectValue, value: float) -> EffectValue:
    """Return an effect's value as it is next to the law; an interval that was found without it moves along."""
    by = value - entry.value
    ci95 = None if entry.ci95 is None else (entry.ci95[0] + by, entry.ci95[1] + by)
    return replace(entry, value=value, ci95=ci95)


def _drawn(
    traces: tuple[Trace, ...], believed: Hypothesis, runs: FreeRuns, tabled: DrivelineModel, final: FitResult
) -> tuple[Trace, ...]:
    """Return the simulations for plots, the augmented ones with the law."""
    kept_out = runs.unseen.chain.records
    outputs = [*final.outputs]
    if kept_out:
        outputs += foreign_outputs(final, tabled, kept_out, all_good_samples(kept_out), believed.effects)
    return tuple(replace(trace, augmented=out) for trace, out in zip(traces, outputs, strict=True))


def _diagnosis_of(law: TableFit, motion: Motion) -> UnnamedTable:
    at = PLACES[law.place]
    return UnnamedTable(
        place=law.place,
        element=at.element,
        over=at.over,
        unit=unit(at.dimension, motion),
        torque_unit=unit("torque", motion),
        knots=law.knots,
        values=law.values,
        ci95=law.ci95 or (),
        reached=law.reached,
        rms_before=law.before,
        rms_after=law.after,
        looks_like=law.looks_like,
        formula=law.formula,
        rival=PLACES[law.rival].over if law.rival else "",
        not_carried=law.not_carried,
    )


def _sentences(table: UnnamedTable, of: str) -> str:
    """Return what is said of the law, for the end of a statement."""
    parts = [
        f"A law without a name is in the augmented model: a torque over {table.over}, through {len(table.knots)} "
        f"knots. On data that no fit has seen the free-run error falls with it from {table.rms_before:.4g} to "
        f"{table.rms_after:.4g} {of}."
    ]
    if table.looks_like:
        parts.append(f"It looks like {table.looks_like}.")
    if table.formula:
        parts.append(f"The shortest formula within its band, with x for {table.over}: {table.formula}.")
    if table.rival:
        parts.append(f"A torque over {table.rival} explains nearly as much.")
    if table.not_carried:
        parts.append(f"It does not carry over to {', '.join(table.not_carried)}.")
    return " ".join(parts)
