"""Diagnose recordings, and keep what they do not decide between."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from estimator.design.open import Candidate, Open, Unnamed, name_of, precision_of
from estimator.design.paper import LEAST_PROBABILITY, TEMPERED
from estimator.design.untested import with_untested
from estimator.diagnosis.assemble import moved_values
from estimator.diagnosis.diagnose import SearchResult, answer
from estimator.diagnosis.first_use import compile_kernels, is_first_use
from estimator.diagnosis.inference.decide import Judged
from estimator.diagnosis.inference.disturbances import estimated
from estimator.diagnosis.inference.fits import Fits
from estimator.diagnosis.inference.hypotheses import GRADE, Effects, Hypothesis, Progress, silent
from estimator.diagnosis.inference.moves import additions
from estimator.diagnosis.inference.trials import necessity
from estimator.diagnosis.preconditions.prepare import prepare
from estimator.diagnosis.result import Diagnosis, Verdict
from estimator.diagnosis.table_curves import alike
from estimator.diagnosis.tables import Law
from estimator.diagnosis.thresholds import Fitting, Judging
from estimator.physics.catalogue import EFFECTS
from estimator.physics.model import DrivelineModel
from estimator.physics.parallel import Work
from estimator.physics.simulate import MASSES
from estimator.physics.unknowns import Shared
from estimator.signals.record import Record

MOST_OPEN = 4
"""Hypotheses that are compared, the most probable: each pair is fitted to every experiment on paper."""


def left_open(
    records: Sequence[Record], model: DrivelineModel, effort: str = "normal", progress: Progress = silent
) -> tuple[Open, Diagnosis]:
    """Diagnose, and return the hypotheses that recordings do not decide between, with the diagnosis."""
    masses = len(MASSES.get(model.structure, ()))
    if masses and is_first_use(masses):
        progress("preparing", 0.0)
        compile_kernels(masses)
    kept_of: list[SearchResult] = []
    with threadpool_limits(1, user_api="blas"):
        ready = prepare(records, model)
        diagnosis = ready.finished(answer(ready, model, progress, effort, Work(), kept_of.append))
        untested = tuple(each.name for each in diagnosis.untestable if not each.needs)
        return with_untested(_open(kept_of[0], untested, diagnosis)), diagnosis


def _open(found: SearchResult, untested: tuple[str, ...], diagnosis: Diagnosis) -> Open:
    """Return the verdict's set and those as probable that do not simulate worse; none counts for more than it does.

    What the verdict says could as well be there counts as much: one of these is named by the likelihood alone.
    """
    search, judged = found.search, found.decision.judged
    best = judged.believed.hypothesis
    near = {
        each.effects: each
        for each in search.fits.ended.values()
        if each.is_plausible
        and not _holds(each.effects, best.effects)
        and not (each.effects in judged.tried and judged.believed.beats(judged.tried[each.effects]))
    }
    as_good = _as_good(search.fits, judged)
    near |= {each.effects: each for each in (*with_one_more(search.fits, judged), *as_good, best)}
    lowest = min(each.score for each in near.values())
    behind = {effects: each.score - lowest for effects, each in near.items()} | dict.fromkeys(
        (best.effects, *(each.effects for each in as_good)), 0.0
    )
    within = max(Judging.ALIKE_WITHIN, 2.0 * TEMPERED * math.log(1.0 / (1.0 - LEAST_PROBABILITY)))
    ordered: list[Hypothesis] = []
    likely = (effects for effects in near if behind[effects] < within)
    for effects in sorted(likely, key=lambda effects: (behind[effects], effects != best.effects, sorted(effects))):
        if len(ordered) < MOST_OPEN and not any(_are_twins(near[effects], other) for other in ordered):
            ordered.append(near[effects])
    weights = [math.exp(-0.5 * behind[each.effects] / TEMPERED) for each in ordered]
    named = frozenset(each.name for each in diagnosis.effects if not EFFECTS[each.name].recognised)
    traces = frozenset(each.name for each in diagnosis.slight)
    total = sum(weights)
    candidates = tuple(
        Candidate(name_of(each.effects), weight / total, each, precision_of(each), moved_values(best, each.result))
        for each, weight in zip(ordered, weights, strict=True)
    )
    names = sorted({name for each in candidates for name in each.effects})
    twins = {name: tuple(EFFECTS[name].equivalent) for name in names if EFFECTS[name].equivalent}
    return Open(
        search.fits.model,
        candidates,
        twins if best.outputs == 1 else {},
        untested,
        named=named if diagnosis.verdict in (Verdict.EXPLAINED, Verdict.NO_MISMATCH) else None,
        traces=traces,
        unnamed=None if found.law is None else _unnamed(found.law, best),
    )


def _unnamed(law: Law, believed: Hypothesis) -> Unnamed | None:
    """Return a law with the values of its curve as unknowns; None next to a load's free course, or of several outputs.

    What recordings tell only together with the curve is held: what the line does straight on at its place, the named
    laws of the same part, and the value at one knot, which a constant load may have. Disturbances are estimated anew:
    without the curve they stand for it.
    """
    result, table = law.found.result, law.found.table
    problem = result.problem
    if GRADE in believed.effects or believed.outputs > 1:
        return None
    size, held = float(np.abs(table.values).max()), alike(problem.shared, table.place)
    line = tuple(
        replace(each, low=float(result.x[i]), high=float(result.x[i])) if i in held else each
        for i, each in enumerate(problem.shared)
    )
    zero = int(np.argmin(np.abs(table.knots)))
    values = {i: value for i, value in enumerate(table.values, start=1) if i - 1 != zero}
    curve = tuple(
        Shared(table.name, f"value_{i}", size, -math.inf, math.inf, value / size) for i, value in values.items()
    )
    x = np.insert(result.x, len(line), [each.start for each in curve])
    released = replace(result, problem=replace(problem, shared=(*line, *curve)), x=x, derivative=None)
    sizes, _ = estimated(released, released.residual, believed.sizes, believed.limits, Fitting.ROUNDS)
    fit = replace(believed, result=released, sizes=sizes)
    return Unnamed(table.place, Candidate(name_of(fit.effects), math.nan, fit, precision_of(fit)), law.line)


def _as_good(fits: Fits, judged: Judged) -> list[Hypothesis]:
    """Return the sets with a look-alike in the place of one of the verdict's names; none that contains the name."""
    effects = judged.believed.effects
    exchanged = (effects - {each.name} | {other} for each in judged.named for other in each.alike)
    return [fits.ended[each] for each in exchanged if each in fits.ended and not _holds(each, effects)]


def with_one_more(fits: Fits, judged: Judged) -> list[Hypothesis]:
    """Return the verdict's set with one effect more, where that may well be there: no name yet, and no trace either.

    The likelihood asks for it, and more than half of what the verdict leaves beyond the noise is gone with it, be that
    too little to be sure of a name. A search ends where what is left is a trace at most: one counts that moves a value.
    """
    believed, noise = judged.believed, judged.noise
    whole = believed.hypothesis
    total = float(fits.trials.one(fits.nothing()).squares.sum())
    asked_for = [each for each in additions(fits, whole) if whole.score - each.score >= Judging.LEAST_EVIDENCE]
    trials = fits.trials.of([each for each in asked_for if each.is_plausible])
    found = []
    for each in trials:
        needed = necessity(each, believed, noise)
        is_trace = float(believed.squares.sum() - each.squares.sum()) < Judging.LEAST_SHARE * total
        if needed.value < Judging.LEAST_NECESSITY or needed.least == 0.0 or any(one.beats(each) for one in trials):
            continue
        if not is_trace or moved_values(whole, each.hypothesis.result):
            found.append(each.hypothesis)
    return found


def _are_twins(one: Hypothesis, other: Hypothesis) -> bool:
    """Tell whether two sets are the same linear system by a single output: no experiment distinguishes them."""
    mine, its = one.effects - other.effects, other.effects - one.effects
    if one.outputs > 1 or len(mine) != 1 or len(its) != 1:
        return False
    return next(iter(its)) in EFFECTS[next(iter(mine))].equivalent


def _holds(effects: Effects, others: Effects) -> bool:
    """Tell whether a set is another one with more in it: what is added has not paid, and is no other explanation."""
    special = effects.union(*(EFFECTS[name].contains for name in effects))
    return effects != others and others <= special
