"""Effects that recordings neither show nor exclude, each supposed in the size at which a fit of it begins.

Some cannot show in what was driven, as the catalogue says of them. Others could, and are too small against the noise,
or too like what is fitted anyway: the innovations that such a size leaves, once the other unknowns have taken what they
can, are fewer than a verdict asks for (the noncentrality of a score test: C. R. Rao, Proc. Cambridge Phil. Soc. 44,
1948). The other unknowns are then fitted with it. How far that moves the values that are reported is what may be wrong
with them; one of the second kind that moves none of them does not matter.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from estimator.design.open import Candidate, Open, Untested, name_of
from estimator.design.paper import LEAST_DIFFERENCE, throughout
from estimator.diagnosis.assemble import moved_values
from estimator.diagnosis.inference.descent import Effort, descended, extended
from estimator.diagnosis.inference.fits import unknowns_of
from estimator.diagnosis.inference.hypotheses import GRADE, Hypothesis, open_hypotheses
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult, warm_start
from estimator.physics.problem import make_problem
from estimator.physics.unknowns import effect_unknowns
from estimator.signals.record import FloatArray

SUPPOSED = Effort(derivatives=2, steps=6)  # of a fit of what is nearly a change of the other unknowns

MOSTLY = 0.5
"""Share of what an effect changes that must be left behind a linear change of the other unknowns for it to be seen
without a fit: of a large effect, such as an inverter's gain, the rest may be what is not linear in it."""

MOST_UNSEEN = 4
"""Effects that could show and do not, those that move a value most: each is tried with every experiment on paper."""


def with_untested(known: Open) -> Open:
    """Suppose the effects that the recordings cannot show, and those that they could and do not."""
    supposed = {name: _settled(known, name, start) for name in known.untested if (start := _start_of(known, name))}
    unseen = sorted(_unseen(known), key=_farthest, reverse=True)[:MOST_UNSEEN]
    names = (*known.untested, *(each.name for each in unseen))
    return replace(known, untested=names, supposed=supposed | {each.name: each for each in unseen})


def _unseen(known: Open) -> Iterator[Untested]:
    """Yield the effects that could show, do not in the size supposed, and move a value out of its interval."""
    first = known.candidates[0].fit
    taken = _directions(first)
    tried = frozenset().union(*(each.effects for each in known.candidates))
    for name in open_hypotheses(known.line, known.records)[0]:
        if name in tried or EFFECTS[name].event:  # an event may come at any time
            continue
        start = _start_of(known, name)
        if start is None:
            continue
        change = first.filter(start.residual - first.result.residual)
        whole = float(change @ change)
        if whole - float(np.sum((taken.T @ change) ** 2)) >= max(LEAST_DIFFERENCE, MOSTLY * whole):
            continue
        found = _settled(known, name, start)
        if (
            found.moves
            and _squares(first, found.supposed.fit.result) - _squares(first, first.result) < LEAST_DIFFERENCE
        ):
            yield found


def _directions(first: Hypothesis) -> FloatArray:
    """Return what the unknowns of a fit can make of the innovations: an orthonormal basis, shape (N, U)."""
    white = first.white
    return np.linalg.qr(white.jacobian[:, ~white.pinned], mode="reduced")[0]


def _squares(first: Hypothesis, result: FitResult) -> float:
    innovations = first.filter(result.residual)
    return float(innovations @ innovations)


def _farthest(untested: Untested) -> float:
    return max(map(abs, untested.moves.values()))


def _start_of(known: Open, name: str) -> FitResult | None:
    """Return the most probable hypothesis with an effect, not yet fitted; None of a profile, which has no size."""
    first, line = known.candidates[0], known.line
    result, records = first.fit.result, first.fit.result.problem.records
    release = effect_unknowns(name, line, records)[0]
    if not release.shared or GRADE in first.effects:
        return None
    held = tuple(replace(each, low=each.start, high=each.start) for each in release.shared)
    before = unknowns_of(result, first.effects | set(line.effects))
    own = [
        (*old, *(throughout(each, record) for each in mine))
        for old, mine, record in zip(before.own, release.own, records, strict=True)
    ]
    problem = make_problem(line, records, (*before.shared, *held), own=own, use=result.problem.use)
    return extended(problem, warm_start(problem, result), result)


def _settled(known: Open, name: str, start: FitResult) -> Untested:
    """Fit the other unknowns with an effect in the size supposed."""
    first = known.candidates[0].fit
    settled = descended(start, first.filter, SUPPOSED)
    fit_with = replace(first, effects=first.effects | {name}, result=settled)
    shared = len(settled.problem.shared)
    candidate = Candidate(name_of(fit_with.effects), math.nan, fit_with, np.zeros((shared, shared)))
    nulls = {each.name: each.null for each in EFFECTS[name].parameters}
    size = {key: x for key, x in settled.values_of(name).items() if x != nulls[key]}
    return Untested(name, size, candidate, moved_values(first, settled))
