"""Laws without a name as tables: at each place the curve with which the free run fits best, if any is better.

A curve's unknowns are the slopes between its knots, which are laid by the data. A fit from a straight curve stays near
it where the law is strongly nonlinear, as a gap or a freewheel is: so each place is begun from several shapes, under an
observer whose gain is let down to 0 (``layout.OBSERVER``). With a large one every sample is a fresh start, and no
simulation runs away.

The samples of each recording are cut into blocks: on some the curve is fitted, others choose its shape, its smoothness
and its place, and the rest, which no choice has seen, say whether it is a law at all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.inference.hypotheses import Effects as Names, Hypothesis
from estimator.diagnosis.inference.trials import between_blocks
from estimator.diagnosis.result import UnnamedTable
from estimator.diagnosis.table_curves import SLIDER, YIELDING, Curve, Masks, curve_at, shapes, signal_over, values_at
from estimator.diagnosis.table_descent import Z95, Descent, reported, rms_over, with_curve
from estimator.diagnosis.table_words import looks_like, shortest_formula
from estimator.physics.driveline import Structure
from estimator.physics.fit import ITERATIONS, FitResult, fit
from estimator.physics.free_run import simulate_foreign
from estimator.physics.layout import slot
from estimator.physics.model import DrivelineModel, EffectValue, unit
from estimator.physics.tables import PLACES, Table
from estimator.signals.record import BoolArray, FloatArray, Record

SEARCHED = {
    Structure.ONE_MASS: ("torque", "motor_speed"),
    Structure.TWO_MASS: ("torque", "motor_speed", "shaft_twist", YIELDING, "shaft_rate", "load_speed"),
    Structure.THREE_MASS: ("torque", "motor_speed", "shaft_twist", YIELDING, "shaft_rate", "load_speed"),
    Structure.JOINT: ("shaft_twist", "shaft_rate"),
}
"""Places at which a curve is looked for."""

BLOCKS, CHOOSING, UNSEEN = 10, (2, 7), (4, 9)
"""Blocks of equal length that each recording is cut into, and which of them choose and which judge; to the rest curves
are fitted. The last one judges: what has run away by then is no law."""

BETTER = 0.97
"""Error on the unseen blocks, over that of the re-tuned model, up to which a curve is a law."""

LOOK_ALIKE_SHARE = 1.1  # the same of a second place over the first, up to which both are reported

GAINS = (0.3, 0.1, 0.03, 0.01, 0.0)
"""Gains of the observer, one after the other."""

SCOUTS, SCOUT_STEPS, STEPS, LAST_STEPS = 2, 3, 4, 10
"""Gains after which only the best shapes and places continue; Jacobians at each gain there, behind, and at the end."""

CONTINUED = 2  # shapes of a place, and places, that continue
AT_SLIDER = slot(SLIDER, "friction_nm")
SMOOTHNESS = (1.0, 0.05)
"""Weights of the curve's bending that are tried: what its slope changes by from one piece to the next, squared, counts
as so many thousandths of the squared error before."""


Effects = Mapping[str, Mapping[str, EffectValue]]
"""Values of effects, by name and parameter."""


@dataclass(frozen=True)
class TableFit:
    """A law without a name, fitted."""

    table: Table  # place, knots and values
    result: FitResult  # the free run with it, the line re-tuned next to it; the curve stands in ``problem.p``
    law: UnnamedTable  # as it is reported
    effects: Effects  # that the model gets: the table, and the slider of one that yields
    between: tuple[FitResult, Effects] | None  # both, fitted to what is between the blocks that judge a diagnosis


def blocks_of(records: Sequence[Record], use: Sequence[BoolArray], which: Sequence[int]) -> Masks:
    """Return which samples that count lie in some of the blocks of their recording."""
    masks = []
    for record, used in zip(records, use, strict=True):
        since = record.time_s - record.time_s[0]
        block = np.minimum((BLOCKS * since / max(float(since[-1]), 1e-12)).astype(int), BLOCKS - 1)
        masks.append(used & np.isin(block, which))
    return tuple(masks)


@dataclass(frozen=True)
class Candidate:
    """The best curve of a place, fitted to the samples that fit."""

    descent: Descent  # for this place
    z: FloatArray  # unknowns, scaled
    smooth: float  # weight of the curve's second differences
    chosen_by: float  # RMS over the samples that choose


Scouted = tuple[Descent, list[tuple[float, FloatArray]]]
"""A place after the first gains: squared error and unknowns that its shapes leave there, the best of them first."""


def _scouted(curve: Curve, retuned: FitResult, fitting: Masks) -> Scouted:
    """Begin the fit of a curve from each of its shapes."""
    descent, left = Descent(curve, retuned, fitting), []
    for slopes in shapes(curve).values():
        z, squares = descent.start(slopes), np.inf
        for gain in GAINS[:SCOUTS]:
            z, squares = descent.fitted(z, gain, SMOOTHNESS[0], SCOUT_STEPS)
        left.append((squares, z))
    return descent, sorted(left, key=lambda each: each[0])


def _best_curve(scouted: Scouted, choosing: Masks) -> Candidate:
    """Let the observer's gain down from the best shapes, and return what the choosing samples prefer."""
    (descent, left), found = scouted, list[Candidate]()
    for _, z in left[:CONTINUED]:
        for gain in GAINS[SCOUTS:]:
            z, _ = descent.fitted(z, gain, SMOOTHNESS[0], STEPS)
        found.append(Candidate(descent, z, SMOOTHNESS[0], descent.error(z, choosing)))
    best = min(found, key=lambda each: each.chosen_by)
    for smooth in SMOOTHNESS[1:]:
        z, _ = descent.fitted(best.z, 0.0, smooth, STEPS)
        best = min(best, Candidate(descent, z, smooth, descent.error(z, choosing)), key=lambda each: each.chosen_by)
    return best


def table_at(hypothesis: Hypothesis, place: str) -> Candidate | None:
    """Return the free form of a law at a place, fitted to all samples that count; None where the line hardly moved."""
    result = hypothesis.result.first_outputs()
    curve = None if place not in SEARCHED[result.problem.grid.structure] else curve_at(place, result, GAINS[0])
    if curve is None:
        return None
    use = result.problem.use
    return _best_curve(_scouted(curve, result, use), use)


def best_table(hypothesis: Hypothesis, line: DrivelineModel, holdout: Sequence[Record] = ()) -> TableFit | None:
    """Return the best law without a name next to a fitted hypothesis of a line; None where none is better.

    It is better on unseen data: on blocks of the recordings, on each whole recording by a fit to the others, together,
    and on ``holdout``, which are kept out of every fit.
    """
    whole = hypothesis.result.first_outputs()
    if whole.problem.grid.plant is not None:
        return None
    records, use = whole.problem.records, whole.problem.use
    unseen, choosing = (blocks_of(records, use, which) for which in (UNSEEN, CHOOSING))
    fitting = tuple(u & ~a & ~b for u, a, b in zip(use, unseen, choosing, strict=True))
    retuned = fit(replace(whole.problem, use=fitting), whole.x, STEPS)
    searched = [each for each in SEARCHED[whole.problem.grid.structure] if each != YIELDING or not whole.p[AT_SLIDER]]
    curves = [curve_at(place, retuned, GAINS[0]) for place in searched]
    places = [_scouted(curve, retuned, fitting) for curve in curves if curve is not None]
    if not places:
        return None
    continued = sorted(places, key=lambda each: each[1][0][0])[:CONTINUED]
    best, *others = sorted((_best_curve(each, choosing) for each in continued), key=lambda each: each.chosen_by)
    seen = tuple(u & ~a for u, a in zip(use, unseen, strict=True))
    known = fit(replace(whole.problem, use=seen), whole.x, ITERATIONS)
    before = min(rms_over(known.problem, each.outputs, unseen) for each in (known, retuned))
    judged, z = _refitted(best, known, seen)
    after = judged.error(z, unseen)
    if after > BETTER * before:
        return None
    last, z = _refitted(replace(best, descent=judged, z=z), whole, use)
    drawn = _drawn_in(replace(best, descent=last, z=z), whole, use)
    result, table = reported(drawn.descent, drawn.z)
    kept, torques = ([], []) if len(records) == 1 else _left_out(best, whole, line, hypothesis.effects, table.knots)
    foreign = _squares_on(holdout, line, hypothesis.effects, whole, result)
    if any(sum(after for _, after in each) > sum(before for before, _ in each) for each in (kept, foreign)):
        return None
    firsts = [record.name for record in records if record.lead is None]
    alike_places = [each.descent.curve.place for each in others if each.chosen_by < LOOK_ALIKE_SHARE * best.chosen_by]
    rivals = [PLACES[place].over for place in alike_places if place != best.descent.curve.place]
    not_carried = [name for name, (without, with_law) in zip(firsts, kept, strict=False) if with_law > without]
    table, place, at = widened_by_jackknife(table, torques), table.place, PLACES[table.place]
    slope = drawn.descent.curve.own * drawn.descent.curve.slope_of(result.p)
    alike, formula, where = looks_like(table, slope), shortest_formula(table, slope), signal_over(place, result, 0.0)
    if drawn.descent.curve.yields:
        of = unit("torque", line.motion)
        alike = f"a clutch that slips at {result.p[AT_SLIDER]:.3g} {of}, by {SLIDER} next to the curve"
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
        looks_like=alike,
        formula=formula,
        rival=next(iter(rivals), ""),
        not_carried=tuple(not_carried),
    )
    between = None if holdout else _between(drawn, whole)
    return TableFit(table, result, law, _effects(drawn.descent, result, table), between)


def _effects(descent: Descent, result: FitResult, table: Table) -> Effects:
    """Return what a model with the law gets."""
    effects: dict[str, Mapping[str, EffectValue]] = {table.name: table.effect()}
    if descent.curve.yields:
        names = ("friction_nm", "yield_rad", "sharpness")
        effects[SLIDER] = {name: EffectValue(float(result.p[slot(SLIDER, name)])) for name in names}
    return effects


def _between(best: Candidate, whole: FitResult) -> tuple[FitResult, Effects]:
    """Return a law that has not seen the blocks by which a diagnosis is judged."""
    use = tuple(
        used & seen for used, seen in zip(whole.problem.use, between_blocks(whole.problem.records), strict=True)
    )
    descent, z = _refitted(best, fit(replace(whole.problem, use=use), whole.x, STEPS), use)
    result, table = reported(descent, z)
    return result, _effects(descent, result, table)


def _refitted(best: Candidate, result: FitResult, use: Masks) -> tuple[Descent, FloatArray]:
    """Fit the best curve to other samples, from where it is."""
    descent = Descent(best.descent.curve, replace(result, x=result.x), use)
    z, _ = descent.fitted(best.z, 0.0, best.smooth, LAST_STEPS)
    return descent, z


def _drawn_in(best: Candidate, result: FitResult, use: Masks) -> Candidate:
    """Draw a curve's knots in to where the simulation with it was, and fit it once more where that changes it."""
    old, slopes = best.descent, slice(best.descent.first, best.descent.after)
    curve = old.curve.drawn_in(signal_over(old.curve.place, with_curve(old, best.z), 0.0))
    between = old.curve.slopes_between(curve.knots, best.z[slopes])
    descent, z = Descent(curve, result, use), np.concatenate([best.z[: slopes.start], between, best.z[slopes.stop :]])
    if not curve.yields:  # a straight one is the same through any knots
        z, _ = descent.fitted(z, 0.0, best.smooth, LAST_STEPS)
    return replace(best, descent=descent, z=z)


Squares = tuple[float, float]
"""Squared error of the free run on a recording that a fit has not seen, without the law and with it."""


def _left_out(
    best: Candidate, whole: FitResult, line: DrivelineModel, effects: Names, knots: Sequence[float]
) -> tuple[list[Squares], list[FloatArray]]:
    """Return, for each recording, the errors on it of a fit to the others, and that fit's torque at some knots.

    They say what a law is worth on a drive of another kind, and how far its curve depends on one drive.
    """
    problem, found, torques = whole.problem, list[Squares](), list[FloatArray]()
    for i, record in enumerate(problem.records):
        seen = tuple(use & (i != j) for j, use in enumerate(problem.use))
        known = fit(replace(problem, use=seen), whole.x, STEPS)
        with_law, table = reported(*_refitted(best, known, seen))
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
    records: Sequence[Record], line: DrivelineModel, effects: Names, without: FitResult, with_law: FitResult
) -> list[Squares]:
    """Return the errors of two fits on recordings that they have not seen."""

    def squares(result: FitResult, record: Record) -> float:
        run = simulate_foreign(line, result.p, result.problem.grid, record, record.okay, effects)
        return float(np.sum((run - record.output)[record.okay] ** 2))

    return [(squares(without, record), squares(with_law, record)) for record in records]
