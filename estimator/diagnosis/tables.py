"""Laws without a name: a curve through knots, as the rival of a second name and next to what is decided.

Nature's laws are written in other forms than the model's. What the form leaves is taken by a second law at the same
element, at thousands of units of likelihood. So each second name there has a rival (`free_form`): the set without it,
and a curve in the variable of the law that is there already.

Next to what is decided the best curve of all places is part of the answer (`unnamed_law`) only where the error of the
augmented model falls with it, on what was fitted and on data that no fit has seen. The samples of each recording are
cut into blocks: on some the curve is fitted, others choose its shape, its smoothness and its place, and the rest, which
no choice has seen, say whether it is a law at all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.inference.decide import Decision
from estimator.diagnosis.inference.figures import FreeRuns, Unseen, foreign_outputs, on_recordings, rms_of
from estimator.diagnosis.inference.hypotheses import Effects, Hypothesis, all_good_samples
from estimator.diagnosis.inference.trials import Trial, between_blocks, inside_blocks
from estimator.diagnosis.result import Fit, Trace, UnnamedTable
from estimator.diagnosis.table_curves import (
    GAINS,
    SLIDER,
    STEPS,
    YIELDING,
    Z95,
    Candidate,
    Curve,
    Descent,
    Masks,
    alike,
    best_curve,
    curve_at,
    rms_over,
    scouted,
    signal_over,
    values_at,
    with_curve,
)
from estimator.diagnosis.table_words import looks_like, shortest_formula
from estimator.diagnosis.thresholds import Curves
from estimator.physics.catalogue import EFFECTS
from estimator.physics.driveline import Structure
from estimator.physics.effect import Element
from estimator.physics.fit import ITERATIONS, FitResult, fit
from estimator.physics.free_run import simulate_foreign
from estimator.physics.jacobian import jacobian_at
from estimator.physics.layout import slot
from estimator.physics.model import DrivelineModel, EffectValue, unit
from estimator.physics.problem import Problem, outputs_at, residual_at
from estimator.physics.tables import DAMPING, PLACES, Table
from estimator.signals.correlation import effective_samples
from estimator.signals.record import BoolArray, FloatArray, Record

AT_SLIDER = slot(SLIDER, "friction_nm")


SEARCHED = {
    Structure.ONE_MASS: ("torque", "motor_speed"),
    Structure.TWO_MASS: ("torque", "motor_speed", "shaft_twist", YIELDING, "shaft_rate", "load_speed"),
    Structure.THREE_MASS: ("torque", "motor_speed", "shaft_twist", YIELDING, "shaft_rate", "load_speed"),
    Structure.JOINT: ("shaft_twist", "shaft_rate"),
}
"""Places at which a curve is looked for."""


VARIABLES: Mapping[Element, str] = {
    Element.TORQUE_PATH: "torque",
    Element.MOTOR: "motor_speed",
    Element.SHAFT: "shaft_twist",
    Element.LOAD: "load_speed",
}
"""The variable that a law's curve is over, by the law's element; a reading has none."""

NO_LAW = (
    f"No law without a name is in the augmented model: no curve with {Curves.FEWEST_SAMPLES} samples between its knots "
    "lowers the error on data that no fit has seen."
)


def free_form(without: Trial, name: str) -> Trial | None:
    """Return a set without a name, with a free form of one of its laws at the name's element; None where none has one.

    Of several measured outputs there is none: a curve is fitted to the first.
    """
    element = EFFECTS[name].element
    if element not in VARIABLES or without.hypothesis.outputs > 1:
        return None
    if all(EFFECTS[other].element is not element for other in without.effects):
        return None
    hypothesis, result = without.hypothesis, without.hypothesis.result
    problem = replace(result.problem, use=between_blocks(result.problem.records))
    curve = curve_through(replace(result, problem=problem).first_outputs(), VARIABLES[element])
    if curve is None:
        return None
    tuned, x = curve.descent.at(0.0), curve.descent.x(curve.z)
    outputs = outputs_at(tuned, x)
    free = FitResult(tuned, x, outputs, residual_at(tuned, outputs), None, False)
    squares, samples = inside_blocks(free)
    return Trial(hypothesis, without.size + 1, free, squares, samples)


def curve_through(result: FitResult, place: str) -> Candidate | None:
    """Return the free form of a law at a place, fitted to all samples that count; None where the line hardly moved."""
    curve = None if place not in SEARCHED[result.problem.grid.structure] else curve_at(place, result, GAINS[0])
    if curve is None:
        return None
    start = scouted(curve, result, result.problem.use)
    return best_curve(start, result.problem.use)


Values = Mapping[str, Mapping[str, EffectValue]]
"""Values of effects, by name and parameter."""


@dataclass(frozen=True)
class TableFit:
    """A law without a name, fitted."""

    table: Table  # place, knots and values
    result: FitResult  # the free run with it, the line re-tuned next to it; the curve stands in ``problem.p``
    law: UnnamedTable  # as it is reported
    effects: Values  # that the model gets: the table, and the slider of one that yields
    between: tuple[FitResult, Values] | None  # both, fitted to what is between the blocks that judge a diagnosis


def blocks_of(records: Sequence[Record], use: Sequence[BoolArray], which: Sequence[int]) -> Masks:
    """Return which samples that count lie in some of the blocks of their recording."""
    masks = []
    for record, used in zip(records, use, strict=True):
        since = record.time_s - record.time_s[0]
        block = np.minimum((Curves.BLOCKS * since / max(float(since[-1]), 1e-12)).astype(int), Curves.BLOCKS - 1)
        masks.append(used & np.isin(block, which))
    return tuple(masks)


def best_table(hypothesis: Hypothesis, line: DrivelineModel, holdout: Sequence[Record] = ()) -> TableFit | None:
    """Return the best law without a name next to a fitted hypothesis of a line; None where none is better.

    It is better on unseen data: on blocks of the recordings, on each whole recording by a fit to the others, together,
    and on ``holdout``, which are kept out of every fit.
    """
    whole = hypothesis.result.first_outputs()
    if whole.problem.grid.plant is not None:
        return None
    records, use = whole.problem.records, whole.problem.use
    unseen, choosing = (blocks_of(records, use, which) for which in (Curves.UNSEEN, Curves.CHOOSING))
    fitting = tuple(u & ~a & ~b for u, a, b in zip(use, unseen, choosing, strict=True))
    retuned = fit(replace(whole.problem, use=fitting), whole.x, STEPS)
    searched = [each for each in SEARCHED[whole.problem.grid.structure] if each != YIELDING or not whole.p[AT_SLIDER]]
    curves = [curve_at(place, retuned, GAINS[0]) for place in searched]
    places = [scouted(curve, retuned, fitting) for curve in curves if curve is not None]
    if not places:
        return None
    continued = sorted(places, key=lambda each: each[1][0][0])[: Curves.CONTINUED]
    best, *others = sorted((best_curve(each, choosing) for each in continued), key=lambda each: each.chosen_by)
    seen = tuple(u & ~a for u, a in zip(use, unseen, strict=True))
    known = fit(replace(whole.problem, use=seen), whole.x, ITERATIONS)
    before = min(rms_over(known.problem, each.outputs, unseen) for each in (known, retuned))
    judged = best.refitted(known, seen)
    after = judged.descent.error(judged.z, unseen)
    if after > Curves.BETTER * before:
        return None
    whole = fit(whole.problem, whole.x, ITERATIONS)
    last = judged.refitted(whole, use).drawn_in(whole, use)
    result, table = reported(last)
    curve = last.descent.curve
    slope = curve.own * curve.slope_of(result.p)
    where = signal_over(table.place, result, 0.0)
    kept, torques = ([], []) if len(records) == 1 else _left_out(best, whole, line, hypothesis.effects, table.knots)
    foreign = _squares_on(holdout, line, hypothesis.effects, whole, result)
    if any(sum(after for _, after in each) > sum(before for before, _ in each) for each in (kept, foreign)):
        return None
    firsts = [record.name for record in records if record.lead is None]
    near = [each for each in others if each.chosen_by < Curves.LOOK_ALIKE_SHARE * best.chosen_by]
    alike_places = [each.descent.curve.place for each in near]
    rivals = [PLACES[place].over for place in alike_places if place != best.descent.curve.place]
    not_carried = [name for name, (without, with_law) in zip(firsts, kept, strict=False) if with_law > without]
    table, place, at = widened_by_jackknife(table, torques), table.place, PLACES[table.place]
    likeness, formula = looks_like(table, slope), shortest_formula(table, slope)
    if curve.yields:
        of = unit("torque", line.motion)
        likeness = f"a clutch that slips at {result.p[AT_SLIDER]:.3g} {of}, by {SLIDER} next to the curve"
        formula = ""
    law = UnnamedTable(
        place=place,
        element=at.element,
        over=at.over,
        unit=unit(at.dimension, line.motion),
        torque_unit=unit("torque", line.motion),
        knots=table.knots,
        values=table.values,
        ci95=table.ci95 or (),
        slope=slope,
        reached=(float(where.min()), float(where.max())),
        rms_before=before,
        rms_after=after,
        looks_like=likeness,
        formula=formula,
        rival=next(iter(rivals), ""),
        not_carried=tuple(not_carried),
    )
    between = None if holdout else _between(last, whole)
    return TableFit(table, result, law, _values(curve, result, table), between)


def _values(curve: Curve, result: FitResult, table: Table) -> Values:
    """Return what a model with the law gets."""
    effects: dict[str, Mapping[str, EffectValue]] = {table.name: table.effect()}
    if curve.yields:
        names = ("friction_nm", "yield_rad", "sharpness")
        effects[SLIDER] = {name: EffectValue(float(result.p[slot(SLIDER, name)])) for name in names}
    return effects


def _between(best: Candidate, whole: FitResult) -> tuple[FitResult, Values]:
    """Return a law that has not seen the blocks by which a diagnosis is judged."""
    seen = between_blocks(whole.problem.records)
    use = tuple(used & between for used, between in zip(whole.problem.use, seen, strict=True))
    result, table = reported(best.refitted(fit(replace(whole.problem, use=use), whole.x, STEPS), use))
    return result, _values(best.descent.curve, result, table)


def reported(found: Candidate) -> tuple[FitResult, Table]:
    """Return the fit with the curve among what is given, and the curve with its intervals."""
    descent, fit = found.descent, with_curve(found)
    problem, x, curve = descent.at(0.0), descent.x(found.z), descent.curve
    values, half = np.zeros(curve.knots.size), np.zeros(curve.knots.size)
    values[curve.free] = x[descent.first : descent.after]
    half[curve.free] = _half_widths(descent, problem, x, fit.outputs, fit.residual)
    bands = tuple((float(v - h), float(v + h)) for v, h in zip(values, half, strict=True))
    damping = float(fit.problem.p[slot(curve.name, DAMPING)]) if curve.more else 0.0
    return fit, Table(curve.place, tuple(curve.knots.tolist()), tuple(values.tolist()), bands, damping)


def _half_widths(
    descent: Descent, problem: Problem, x: FloatArray, outputs: Sequence[FloatArray], residual: FloatArray
) -> FloatArray:
    """Return half of the 95 % intervals of the values [Nm]: of errors that are worth fewer than they are."""
    derivative = jacobian_at(problem, x, outputs)
    derivative[:, alike(problem.shared[: descent.first], descent.curve.place)] = 0.0  # recordings know the sum
    free = np.flatnonzero(derivative.any(axis=0) & (descent.low < descent.high))
    j = derivative[:, free]
    variance = float(residual @ residual) / effective_samples([residual])
    scale = np.sqrt(np.maximum(np.diag(j.T @ j), 1e-300))
    inverse = np.linalg.pinv((j / scale).T @ (j / scale), rcond=1e-10, hermitian=True) / np.outer(scale, scale)
    spread = np.zeros(x.size)
    spread[free] = np.sqrt(np.maximum(np.diag(inverse), 0.0) * variance)
    return Z95 * spread[descent.first : descent.after]


Squares = tuple[float, float]
"""Squared error of the free run on a recording that a fit has not seen, without the law and with it."""


def _left_out(
    best: Candidate, whole: FitResult, line: DrivelineModel, effects: Effects, knots: Sequence[float]
) -> tuple[list[Squares], list[FloatArray]]:
    """Return, for each recording, the errors on it of a fit to the others, and that fit's torque at some knots.

    They say what a law is worth on a drive of another kind, and how far its curve depends on one drive.
    """
    problem, found, torques = whole.problem, list[Squares](), list[FloatArray]()
    for i, record in enumerate(problem.records):
        seen = tuple(use & (i != j) for j, use in enumerate(problem.use))
        known = fit(replace(problem, use=seen), whole.x, STEPS)
        with_law, table = reported(best.refitted(known, seen))
        found += _squares_on([record], line, effects, known, with_law)
        torques.append(values_at(table, at := np.array(knots)) + best.descent.curve.slope_of(with_law.p) * at)
    return found, torques


def widened_by_jackknife(table: Table, torques: Sequence[FloatArray]) -> Table:
    """Widen the intervals of a curve to those by the jackknife, of the torques without one recording each.

    ``torques`` has the curve at its K knots for each recording left out, each (K,) [Nm] (Efron and Tibshirani, An
    Introduction to the Bootstrap, 1993, ch. 11). Where an error grows along a simulation, as behind a freewheel, its
    derivative holds for the smallest changes alone.
    """
    if table.ci95 is None or not torques:
        return table
    half = Z95 * np.sqrt(len(torques) - 1.0) * np.std(torques, axis=0)
    bands = zip(table.ci95, table.values, half.tolist(), strict=True)
    return replace(table, ci95=tuple((min(low, v - h), max(high, v + h)) for (low, high), v, h in bands))


def _squares_on(
    records: Sequence[Record], line: DrivelineModel, effects: Effects, without: FitResult, with_law: FitResult
) -> list[Squares]:
    """Return the errors of two fits on recordings that they have not seen."""

    def squares(result: FitResult, record: Record) -> float:
        run = simulate_foreign(line, result.p, result.problem.grid, record, record.okay, effects)
        return float(np.sum((run - record.output)[record.okay] ** 2))

    return [(squares(without, record), squares(with_law, record)) for record in records]


@dataclass(frozen=True, slots=True)
class Law:
    """A law without a name that is in the augmented model."""

    fit: Fit  # the decision's figures, those of the augmented model with the law
    found: TableFit  # its fit to the recordings
    final: FitResult  # the free runs of all recordings with it
    line: DrivelineModel  # the line with the law among its effects
    table: UnnamedTable  # the law, as it is reported
    said: str  # what is said of it, for the end of a statement

    def augmented(self, model: DrivelineModel) -> DrivelineModel:
        """Return a model with the law, and the line and its effects as they are next to it."""
        of_line = self.final.values_of("")
        parameters = {name: p.at(of_line.get(name, p.value)) for name, p in model.parameters.items()}
        effects: dict[str, Mapping[str, EffectValue]] = {}
        for name, values in model.effects.items():
            found = self.final.values_of(name)
            effects[name] = {key: value.at(found.get(key, value.value)) for key, value in values.items()}
        return _with_effects(replace(model, parameters=parameters, effects=effects), self.found.effects)

    def drawn(self, traces: tuple[Trace, ...], believed: Hypothesis, runs: FreeRuns) -> tuple[Trace, ...]:
        """Return the simulations for plots, the augmented ones with the law."""
        kept_out = runs.unseen.chain.records
        outputs = [*runs.chain.read(self.final.outputs)]
        if kept_out:
            outputs += foreign_outputs(self.final, self.line, kept_out, all_good_samples(kept_out), believed.effects)
        return tuple(replace(trace, augmented=out) for trace, out in zip(traces, outputs, strict=True))


def unnamed_law(decision: Decision) -> Law | None:
    """Return the best law without a name next to what is believed; None where nothing is left, or none is better."""
    judged, runs, figures = decision.judged, decision.runs, decision.figures
    if not judged.failed or judged.off_nominal:
        return None
    believed, line = judged.believed.hypothesis, runs.unseen.line
    found = best_table(believed, line, runs.unseen.chain.records)
    if found is None:
        return None
    tabled = _with_effects(line, found.effects)
    with_it = replace(believed, result=found.result)
    after = on_recordings(with_it, tabled, runs.chain.separated, is_whole=False)
    result, effects = found.between or (found.result, found.effects)  # recordings that are kept out judge the whole one
    unseen = Unseen(_with_effects(line, effects), runs.unseen.chain)
    held = unseen.rms(replace(believed, result=result), after, False, runs.chain, is_as_read=True)
    final = after.first_outputs()
    rms = rms_of(runs.chain.errors(final.outputs))
    if rms >= figures.augmented or held >= figures.holdout_augmented:
        return None
    fit = replace(figures, augmented=rms, holdout_augmented=held)
    law = replace(found.law, rms_before=figures.holdout_augmented, rms_after=held)  # on the samples of all figures
    return Law(fit, replace(found, law=law), final, tabled, law, sentences(law, fit.unit))


def _with_effects(model: DrivelineModel, effects: Values) -> DrivelineModel:
    return replace(model, effects={**model.effects, **effects})


def sentences(table: UnnamedTable, of: str) -> str:
    """Return what is said of the law, for the end of a statement."""
    parts = (
        f"A law without a name is in the augmented model: a torque over {table.over}, through "
        f"{len(table.knots)} knots. On samples not used for its fit the free-run error falls with it "
        f"from {table.rms_before:.4g} to {table.rms_after:.4g} {of}.",
        table.looks_like and f"It looks like {table.looks_like}.",
        table.formula and f"The shortest formula within its band, with x for {table.over}: {table.formula}.",
        table.rival and f"A torque over {table.rival} explains nearly as much.",
        f"It does not carry over to {', '.join(table.not_carried)}." if table.not_carried else "",
    )
    return " ".join(filter(None, parts))
