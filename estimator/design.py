"""The next experiment, judged before it is driven: how well it distinguishes hypotheses, what it makes known.

An experiment on paper is a recording that one hypothesis would give. Another hypothesis is fitted to it: its unknowns,
held by what earlier recordings say of them, move to where the innovations are least, and what these still are is the
expected difference of scores (T-optimality: Atkinson and Fedorov, Biometrika 62, 1975; Box and Hill, Technometrics 9,
1967). Around a fit the information about its unknowns is that of its whitened derivative (D-optimality; Goodwin and
Payne, Dynamic System Identification, 1977).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from estimator.diagnosis.assemble import Z95
from estimator.diagnosis.first_use import compile_kernels, is_first_use
from estimator.diagnosis.inference.answer import Found, answer
from estimator.diagnosis.inference.checks import THRESHOLDS
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
)
from estimator.diagnosis.inference.standing import ALIKE_WITHIN
from estimator.diagnosis.preconditions.prepare import prepare
from estimator.diagnosis.result import Diagnosis
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult, fit
from estimator.physics.jacobian import jacobian_at
from estimator.physics.layout import grid_for
from estimator.physics.model import DrivelineModel, EffectValue, parameter_unit
from estimator.physics.parallel import Work
from estimator.physics.problem import make_problem, parameters
from estimator.physics.simulate import MASSES
from estimator.physics.unknowns import Shared, own_unknowns
from estimator.signals.record import FloatArray, Record

MOST_OPEN = 4
"""Hypotheses that are compared, the most probable: each pair is fitted to every experiment on paper."""

ITERATIONS = 8  # steps of a fit of what is a recording's own, which is nearly linear
TEMPERED: float = THRESHOLDS["odds"]["tempered"]
"""By which differences of scores are divided: laws of nature are written in other forms than the model's."""

LEAST_PROBABILITY = 0.9  # odds from which one hypothesis is enough

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
class Open:
    """What recordings leave open."""

    line: DrivelineModel  # the model without effects, as re-tuned
    candidates: tuple[Candidate, ...]  # the most probable first
    twins: Mapping[str, tuple[str, ...]]  # by effect: those that the recordings cannot distinguish from it
    untested: tuple[str, ...]  # effects that these recordings can neither show nor exclude, and others could

    @property
    def is_decided(self) -> bool:
        """Whether one hypothesis is as probable as what a diagnosis names."""
        return len(self.candidates) == 1 or self.candidates[0].probability >= LEAST_PROBABILITY


def left_open(
    records: Sequence[Record], model: DrivelineModel, effort: str = "normal", progress: Progress = silent
) -> tuple[Open, Diagnosis]:
    """Diagnose, and return the hypotheses that recordings do not decide between, with the diagnosis."""
    masses = len(MASSES.get(model.structure, ()))
    if masses and is_first_use(masses):
        progress("preparing", 0.0)
        compile_kernels(masses)
    kept: list[Found] = []
    with threadpool_limits(1, user_api="blas"):
        ready = prepare(records, model)
        diagnosis = ready.finished(answer(ready, model, progress, effort, Work(), kept.append))
    untested = tuple(each.name for each in diagnosis.untestable if not each.needs)
    return _open(kept[0], untested), diagnosis


def _open(found: Found, untested: tuple[str, ...]) -> Open:
    search, best = found.search, found.decision.judged.believed.hypothesis
    within = max(ALIKE_WITHIN, 2.0 * TEMPERED * math.log(1.0 / (1.0 - LEAST_PROBABILITY)))
    near = {
        each.effects: each
        for each in search.visited.values()
        if search.is_plausible(each) and each.score - best.score < within and not _holds(each.effects, best.effects)
    } | {best.effects: best}
    ordered: list[Hypothesis] = []
    for each in sorted(near.values(), key=lambda each: (each.score, sorted(each.effects))):
        if len(ordered) < MOST_OPEN and not any(_are_twins(each, other) for other in ordered):
            ordered.append(each)
    weights = np.exp([-0.5 * (each.score - ordered[0].score) / TEMPERED for each in ordered])
    candidates = tuple(
        Candidate(name_of(each.effects), float(weight), of_first_outputs(each), _precision(of_first_outputs(each)))
        for each, weight in zip(ordered, weights / weights.sum(), strict=True)
    )
    names = sorted({name for each in candidates for name in each.effects})
    twins = {name: tuple(EFFECTS[name].equivalent) for name in names if EFFECTS[name].equivalent}
    return Open(search.model, candidates, twins if best.outputs == 1 else {}, untested)


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
    """Return the effects that no recording so far could show, and an experiment on paper would."""
    return tuple(name for name in known.untested if EFFECTS[name].testable(known.line, [record]) is None)


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
