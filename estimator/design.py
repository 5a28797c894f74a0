"""The next experiment, judged before it is driven: how well it distinguishes hypotheses, what it makes known.

An experiment on paper is a recording that one hypothesis would give. Another hypothesis is fitted to it: its unknowns,
held by what earlier recordings say of them, move to where the innovations are least, and what these still are is the
expected difference of scores (T-optimality: Atkinson and Fedorov, Biometrika 62, 1975; Box and Hill, Technometrics 9,
1967). Around a fit the information about its unknowns is that of its whitened derivative (D-optimality; Goodwin and
Payne, Dynamic System Identification, 1977).

An effect that the recordings so far can neither show nor exclude is supposed in the size at which a fit of it begins,
the other unknowns fitted to these recordings. How far that moves the values that are reported is what may be wrong with
them; an experiment shows the effect if the recordings and it together can, and tell the supposed line from the one
without.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from threadpoolctl import threadpool_limits

from estimator.diagnosis.assemble import Z95, moved_values
from estimator.diagnosis.first_use import compile_kernels, is_first_use
from estimator.diagnosis.inference.answer import SearchResult, answer
from estimator.diagnosis.inference.checks import THRESHOLDS
from estimator.diagnosis.inference.descent import Effort, descended, extended
from estimator.diagnosis.inference.disturbances import whitener_of
from estimator.diagnosis.inference.hypotheses import (
    GRADE,
    Effects,
    Hypothesis,
    Progress,
    covariance,
    line_values,
    of_first_outputs,
    silent,
    unknowns_of,
)
from estimator.diagnosis.inference.standing import ALIKE_WITHIN
from estimator.diagnosis.preconditions.prepare import prepare
from estimator.diagnosis.result import Diagnosis, Verdict
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult, fit, warm_start
from estimator.physics.jacobian import jacobian_at
from estimator.physics.layout import grid_for
from estimator.physics.model import DrivelineModel, EffectValue, parameter_unit
from estimator.physics.parallel import Work
from estimator.physics.problem import make_problem, parameters
from estimator.physics.simulate import MASSES
from estimator.physics.unknowns import Shared, effect_unknowns, own_unknowns
from estimator.signals.record import FloatArray, Record

MOST_OPEN = 4
"""Hypotheses that are compared, the most probable: each pair is fitted to every experiment on paper."""

ITERATIONS = 8  # steps of a fit of what is a recording's own, which is nearly linear
TEMPERED: float = THRESHOLDS["odds"]["tempered"]
"""By which differences of scores are divided: laws of nature are written in other forms than the model's."""

LEAST_PROBABILITY = 0.9  # odds from which one hypothesis is enough

STANDS = 0.05
"""Probability from which another explanation stands against the verdict: what one in twenty would be wrong by."""

SUPPOSED = Effort(derivatives=2, steps=6)  # of a fit of what is nearly a change of the other unknowns

MOST_LOG_ODDS = 700.0  # largest logarithm of odds that is given: its exponential is still a number


@dataclass(frozen=True, slots=True)
class Candidate:
    """A hypothesis that recordings leave open."""

    name: str  # its effects joined by " + "; "nothing" for the nominal model re-tuned
    probability: float  # among the hypotheses that are open, as the judge counts odds
    fit: Hypothesis  # of the recordings' first outputs
    precision: FloatArray  # (S, S): What recordings say of its shared unknowns

    @property
    def effects(self) -> Effects:
        """The effects of the catalogue that it adds."""
        return self.fit.effects


@dataclass(frozen=True, slots=True)
class Untested:
    """An effect that recordings can neither show nor exclude, in the size at which a fit of it begins."""

    name: str
    size: Mapping[str, float]  # values of its parameters, where they are not those at which the law does nothing
    supposed: Candidate  # the most probable hypothesis with it, its other unknowns fitted to the recordings
    moves: Mapping[str, float]  # values reported that leave their 95 % intervals with it: by what share of themselves


@dataclass(frozen=True, slots=True)
class Open:
    """What recordings leave open."""

    line: DrivelineModel  # the model without effects, as re-tuned
    candidates: tuple[Candidate, ...]  # the most probable first
    twins: Mapping[str, tuple[str, ...]]  # by effect: those that the recordings cannot distinguish from it
    untested: tuple[str, ...]  # effects that these recordings can neither show nor exclude, and others could
    supposed: Mapping[str, Untested] = field(default_factory=dict)  # those of them that have a size to suppose
    named: Effects | None = None  # what the verdict names; None where it leaves something without a name
    traces: Effects = frozenset()  # seen, and too small to matter: with or without them, the verdict is the same

    @property
    def records(self) -> tuple[Record, ...]:
        """The recordings so far, by their first outputs."""
        return self.candidates[0].fit.result.problem.records

    @property
    def against(self) -> tuple[Candidate, ...]:
        """Explanations other than the verdict's that are too probable for it to stand."""
        return tuple(
            each
            for each in self.candidates
            if each.probability > STANDS and each.effects - self.traces != (self.named or frozenset()) - self.traces
        )

    @property
    def is_decided(self) -> bool:
        """Whether the verdict explains the recordings, and no other explanation stands against it."""
        has_twins = any(name in self.twins for name in self.candidates[0].effects)
        return self.named is not None and not self.against and not has_twins


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
        known = _open(kept_of[0], untested, diagnosis)
        each_supposed = {name: _supposed(known, name) for name in untested}
    return replace(known, supposed={name: each for name, each in each_supposed.items() if each}), diagnosis


def _open(found: SearchResult, untested: tuple[str, ...], diagnosis: Diagnosis) -> Open:
    """Return the verdict's set and those as probable that do not simulate worse; none counts for more than it does."""
    search, judged = found.search, found.decision.judged
    best = judged.believed.hypothesis
    within = max(ALIKE_WITHIN, 2.0 * TEMPERED * math.log(1.0 / (1.0 - LEAST_PROBABILITY)))
    near = {
        each.effects: each
        for each in search.fits.ended.values()
        if search.fits.is_plausible(each)
        and each.score - best.score < within
        and not _holds(each.effects, best.effects)
        and not (each.effects in judged.tried and judged.believed.beats(judged.tried[each.effects]))
    } | {best.effects: best}
    behind = {effects: max(each.score - best.score, 0.0) for effects, each in near.items()}
    ordered: list[Hypothesis] = []
    for effects in sorted(near, key=lambda effects: (behind[effects], effects != best.effects, sorted(effects))):
        if len(ordered) < MOST_OPEN and not any(_are_twins(near[effects], other) for other in ordered):
            ordered.append(near[effects])
    weights = [math.exp(-0.5 * behind[each.effects] / TEMPERED) for each in ordered]
    is_made = diagnosis.verdict in (Verdict.EXPLAINED, Verdict.NO_MISMATCH)
    named = frozenset(each.name for each in diagnosis.effects if not EFFECTS[each.name].recognised)
    traces = frozenset(each.name for each in diagnosis.slight)
    total = sum(weights)
    candidates = tuple(
        Candidate(name_of(each.effects), weight / total, of_first_outputs(each), _precision(of_first_outputs(each)))
        for each, weight in zip(ordered, weights, strict=True)
    )
    names = sorted({name for each in candidates for name in each.effects})
    twins = {name: tuple(EFFECTS[name].equivalent) for name in names if EFFECTS[name].equivalent}
    return Open(
        search.fits.model,
        candidates,
        twins if best.outputs == 1 else {},
        untested,
        named=named if is_made else None,
        traces=traces,
    )


def _supposed(known: Open, name: str) -> Untested | None:
    """Suppose an untested effect next to the most probable hypothesis; None of a profile, which has no size."""
    first, line = known.candidates[0], known.line
    result, release = first.fit.result, effect_unknowns(name, line, known.records)[0]
    if not release.shared or GRADE in first.effects:
        return None
    held = tuple(replace(each, low=each.start, high=each.start) for each in release.shared)
    before = unknowns_of(result, first.effects | set(line.effects))
    own = [
        (*old, *(_throughout(each, record) for each in mine))
        for old, mine, record in zip(before.own, release.own, known.records, strict=True)
    ]
    problem = make_problem(line, known.records, (*before.shared, *held), own=own, use=result.problem.use)
    begun = extended(problem, warm_start(problem, result), result)
    settled = descended(begun, whitener_of(begun, first.fit.sizes), SUPPOSED)
    fit_with = replace(first.fit, effects=first.effects | {name}, result=settled)
    moves = moved_values(first.fit, settled)
    candidate = Candidate(name_of(fit_with.effects), math.nan, fit_with, np.zeros((len(problem.shared),) * 2))
    nulls = {each.name: each.null for each in EFFECTS[name].parameters}
    values = settled.values_of(name)
    return Untested(name, {key: x for key, x in values.items() if x != nulls[key]}, candidate, moves)


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


def name_of(effects: Effects) -> str:
    """Return a set of effects as one name."""
    return " + ".join(sorted(effects)) or "nothing"


def as_model(candidate: Candidate, line: DrivelineModel) -> DrivelineModel:
    """Return a hypothesis as a model to drive on paper; its events last throughout, a road stays level."""
    result = candidate.fit.result
    values = line_values(result)
    always = {"from_s": EffectValue(0.0), "to_s": EffectValue(1e9)}
    added = {
        # a parameter that a model may leave out is none where there is no such limit
        name: {key: EffectValue(value) for key, value in result.values_of(name).items() if math.isfinite(value)}
        | (always if EFFECTS[name].event else {})
        for name in candidate.effects - {GRADE}
    }
    given = {name: replace(each, value=values[name]) for name, each in line.parameters.items()}
    return replace(line, parameters=given, effects={**line.effects, **added})


def _on_paper(candidate: Candidate, line: DrivelineModel, record: Record) -> FitResult:
    fitted, effects = candidate.fit.result, candidate.effects - {GRADE}
    shared = fitted.problem.shared
    own = tuple(_throughout(each, record) for each in own_unknowns({*line.effects, *effects}, record))
    problem = make_problem(line, [record], shared, own=[own], grid=grid_for(line, [record]))
    x = np.concatenate([fitted.x[: len(shared)], problem.local[0].guess])
    alone = replace(problem, p=parameters(problem, x), shared=())
    settled = fit(alone, x[len(shared) :], ITERATIONS)
    whole = np.concatenate([x[: len(shared)], settled.x])
    return FitResult(problem, whole, settled.outputs, settled.residual, None, settled.converged)


def _throughout(unknown: Shared, record: Record) -> Shared:
    """Return a moment of an event that lasts from the first sample to the last; anything else as it is."""
    if unknown.name not in ("from_s", "to_s") or not EFFECTS[unknown.effect].event:
        return unknown
    at = float(record.since_start_s[0 if unknown.name == "from_s" else -1])
    return replace(unknown, start=at, low=at, high=at)


def distance(truth: Candidate, rival: Candidate, line: DrivelineModel, record: Record) -> float:
    """Return by how much the rival's score is expected to rise over the truth's if an experiment is driven."""
    simulated = _on_paper(truth, line, record)
    other = _on_paper(rival, line, replace(record, output=simulated.outputs[0]))
    whitened, derivative, held = _whitened(rival, other)
    rows = np.linalg.qr(np.vstack([derivative, held]), mode="reduced")[0]
    error = np.concatenate([whitened, np.zeros(held.shape[0])])
    return float(max(error @ error - np.sum((rows.T @ error) ** 2), 0.0))


def _whitened(candidate: Candidate, on_paper: FitResult) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return innovations, their derivative by the free unknowns, and rows that hold these where they are known."""
    problem = on_paper.problem
    filtered = whitener_of(on_paper, candidate.fit.sizes)
    known = candidate.precision
    free = ~on_paper.pinned
    free[: len(problem.shared)] &= np.diag(known) > 0.0
    derivative = filtered(jacobian_at(problem, on_paper.x, on_paper.outputs)[:, free])
    held = np.zeros((len(problem.shared), on_paper.x.size))
    held[:, : len(problem.shared)] = _root(known)
    return filtered(on_paper.residual), derivative, held[:, free]


def _precision(hypothesis: Hypothesis) -> FloatArray:
    count = len(hypothesis.result.problem.shared)
    spread = covariance(hypothesis)[:count, :count]
    free = np.diag(spread) > 0.0
    known = np.zeros((count, count))
    known[np.ix_(free, free)] = np.linalg.pinv(spread[np.ix_(free, free)], hermitian=True)
    return known


def _root(known: FloatArray) -> FloatArray:
    values, vectors = np.linalg.eigh(known)
    return np.sqrt(np.maximum(values, 0.0))[:, np.newaxis] * vectors.T


@dataclass(frozen=True, slots=True)
class Expected:
    """What an experiment is expected to decide."""

    gained: FloatArray  # (K, K)
    right: float  # expected probability of the true hypothesis after it

    @property
    def factor(self) -> float:
        """The factor by which odds change, whichever is true, between the two hypotheses that it distinguishes best."""
        both = np.minimum(self.gained, self.gained.T)
        return math.exp(min(float(both.max()), MOST_LOG_ODDS))


def expected(known: Open, record: Record) -> Expected:
    """Return what an experiment with a recording's torques decides."""
    count = len(known.candidates)
    gained = np.zeros((count, count))
    for i, j in np.ndindex(count, count):
        if i != j:
            truth, rival = known.candidates[i], known.candidates[j]
            gained[i, j] = 0.5 * distance(truth, rival, known.line, record) / TEMPERED
    probability = np.array([each.probability for each in known.candidates])
    rivals = np.exp(-np.minimum(gained, MOST_LOG_ODDS)) * probability / probability[:, np.newaxis]
    return Expected(gained, float(probability @ (1.0 / rivals.sum(axis=1))))


def shown(known: Open, record: Record) -> tuple[str, ...]:
    """Return the effects that no recording so far could show, and all of them with an experiment on paper would.

    One that has a size to suppose has to change the odds by as much as a diagnosis asks for.
    """
    least = 2.0 * TEMPERED * math.log(LEAST_PROBABILITY / (1.0 - LEAST_PROBABILITY))
    together = [*known.records, record]
    return tuple(
        name
        for name in known.untested
        if EFFECTS[name].testable(known.line, together) is None
        and (
            name not in known.supposed
            or distance(known.supposed[name].supposed, known.candidates[0], known.line, record) > least
        )
    )


@dataclass(frozen=True, slots=True)
class Width:
    """How well a value is known: half of its 95 % interval, now and after an experiment, in its unit."""

    name: str  # of the parameter
    value: float  # as it is known now, in `unit`
    now: float  # half of the 95 % interval now
    after: float  # half of it after the experiment
    unit: str  # SI, as reports show it


def widths(candidate: Candidate, line: DrivelineModel, record: Record) -> Iterator[Width]:
    """Return how well each value of a hypothesis is known now, and with an experiment besides."""
    on_paper = _on_paper(candidate, line, record)
    shared = on_paper.problem.shared
    _, derivative, held = _whitened(candidate, on_paper)
    known = candidate.precision
    free = np.flatnonzero(np.diag(known) > 0.0)
    now = np.linalg.pinv(known[np.ix_(free, free)], hermitian=True)
    after = np.linalg.pinv(derivative.T @ derivative + held.T @ held, hermitian=True)
    for row, i in enumerate(free):
        unknown = shared[i]
        half = [Z95 * unknown.scale * math.sqrt(max(float(each[row, row]), 0.0)) for each in (now, after)]
        yield Width(
            f"{unknown.effect}.{unknown.name}" if unknown.effect else unknown.name,
            float(on_paper.x[i]) * unknown.scale,
            half[0],
            half[1],
            _unit(unknown, line),
        )


def _unit(unknown: Shared, line: DrivelineModel) -> str:
    if not unknown.effect:
        return parameter_unit(unknown.name, line.motion) if unknown.name in line.parameters else ""
    return next(p.unit(line.motion) for p in EFFECTS[unknown.effect].parameters if p.name == unknown.name)
