"""The next experiment, judged before it is driven: how well it distinguishes hypotheses, what it makes known.

An experiment on paper is a recording that one hypothesis would give. Another hypothesis is fitted to it: its unknowns,
held by what earlier recordings say of them, move to where the innovations are least, and what these still are is the
expected difference of scores (T-optimality: Atkinson and Fedorov, Biometrika 62, 1975; Box and Hill, Technometrics 9,
1967). Around a fit the information about its unknowns is that of its whitened derivative (D-optimality; Goodwin and
Payne, Dynamic System Identification, 1977).

An effect that was not tested is shown by an experiment if the recordings and it together can, and distinguish the
supposed line from the one without. What a rig records next to its first output is on paper, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.design.open import Candidate, Open
from estimator.diagnosis.assemble import load_torques
from estimator.diagnosis.covariance import Z95
from estimator.diagnosis.inference.descent import covariance_of_innovations
from estimator.diagnosis.inference.disturbances import whitener_of
from estimator.diagnosis.inference.hypotheses import GRADE
from estimator.diagnosis.line.line import line_values
from estimator.diagnosis.thresholds import THRESHOLDS
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult, fit
from estimator.physics.jacobian import jacobian_at
from estimator.physics.layout import grid_for
from estimator.physics.model import DrivelineModel, EffectValue, parameter_unit
from estimator.physics.problem import Problem, make_problem, outputs_at, parameters
from estimator.physics.unknowns import Shared, own_unknowns
from estimator.signals.record import FloatArray, Record, by_output

ITERATIONS = 8  # steps of a fit of what is a recording's own, which is nearly linear
TEMPERED: float = THRESHOLDS["odds"]["tempered"]
"""By which differences of scores are divided: laws of nature are written in other forms than the model's."""

LEAST_PROBABILITY = 0.9  # odds from which one hypothesis is enough

LEAST_DIFFERENCE = 2.0 * TEMPERED * math.log(LEAST_PROBABILITY / (1.0 - LEAST_PROBABILITY))
"""Difference of squared innovations that makes one of two hypotheses as probable as a verdict asks for."""

MOST_LOG_ODDS = 700.0  # largest logarithm of odds that is given: its exponential is still a number


def as_model(candidate: Candidate, line: DrivelineModel) -> DrivelineModel:
    """Return a hypothesis as a model to drive on paper; its events last throughout.

    The load is the constant torque of the recording that knows it best: what pushed the vehicle will push it again.
    """
    result = candidate.fit.result
    values = line_values(result)
    always = {"from_s": EffectValue(0.0), "to_s": EffectValue(1e9)}
    added = {
        # a parameter that a model may leave out is none where there is no such limit
        name: {key: EffectValue(value) for key, value in result.values_of(name).items() if math.isfinite(value)}
        | (always if EFFECTS[name].event else {})
        for name in candidate.effects - {GRADE}
    }
    given = {name: each.at(values[name]) for name, each in line.parameters.items()}
    loads = load_torques(result, covariance_of_innovations(candidate.fit), line).values()
    load = min(loads, key=lambda each: each.ci95[1] - each.ci95[0]).value
    return replace(line, parameters=given, effects={**line.effects, **added}, load=load)


def _on_paper(candidate: Candidate, line: DrivelineModel, records: Sequence[Record]) -> FitResult:
    """Return a hypothesis under an experiment's torques; what is the recording's own is fitted to its outputs."""
    fitted, problem = candidate.fit.result, _problem(candidate, line, records)
    x = np.concatenate([fitted.x[: len(problem.shared)], problem.local[0].guess])
    alone = replace(problem, p=parameters(problem, x), shared=())
    settled = fit(alone, x[len(problem.shared) :], ITERATIONS)
    whole = np.concatenate([x[: len(problem.shared)], settled.x])
    return FitResult(problem, whole, settled.outputs, settled.residual, None, settled.converged)


def _problem(candidate: Candidate, line: DrivelineModel, records: Sequence[Record]) -> Problem:
    names = {*line.effects, *(candidate.effects - {GRADE})}
    own = tuple(throughout(each, records[0]) for each in own_unknowns(names, records[0]))
    shared = candidate.fit.result.problem.shared
    return make_problem(line, records, shared, own=[own] * len(records), grid=grid_for(line, records))


def throughout(unknown: Shared, record: Record) -> Shared:
    """Return a moment of an event that lasts from the first sample to the last; anything else as it is."""
    if unknown.name not in ("from_s", "to_s") or not EFFECTS[unknown.effect].event:
        return unknown
    at = float(record.since_start_s[0 if unknown.name == "from_s" else -1])
    return replace(unknown, start=at, low=at, high=at)


def _recorded(candidate: Candidate, line: DrivelineModel, record: Record) -> list[Record]:
    """Return an experiment by each output that the recordings so far have, as a hypothesis would give them."""
    alone, known = _on_paper(candidate, line, [record]), candidate.fit.result.problem.records
    further = [_like(known[part.start], record) for part in by_output(known)[1:]]
    given = outputs_at(_problem(candidate, line, [record, *further]), alone.x)
    first = replace(record, output=given[0])
    return [first, *(replace(each, output=y, lead=first) for each, y in zip(further, given[1:], strict=True))]


def _like(output: Record, record: Record) -> Record:
    """Return a further output of a recording; until it is simulated it has the size that it was seen to have."""
    size = np.full(record.time_s.size, np.abs(output.output[output.okay]).max())
    return replace(
        record,
        output=size,
        lead=record,
        kind=output.kind,
        location=output.location,
        label=output.label,
        unit=output.unit,
    )


def distance(truth: Candidate, rival: Candidate, line: DrivelineModel, record: Record) -> float:
    """Return by how much the rival's score is expected to rise over the truth's if an experiment is driven."""
    other = _on_paper(rival, line, _recorded(truth, line, record))
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


def shown(known: Open, record: Record) -> dict[str, float]:
    """Return the effects that no recording so far shows or excludes, and all of them with an experiment on paper do.

    Each with its expected difference of scores, which has to change the odds by as much as a diagnosis asks for;
    infinite where the effect has no size to suppose.
    """
    together = [*known.records, record]
    found = {}
    for name in known.untested:
        if EFFECTS[name].testable(known.line, together) is None:
            supposed = known.supposed.get(name)
            truth = None if supposed is None else supposed.supposed
            found[name] = math.inf if truth is None else distance(truth, known.candidates[0], known.line, record)
    return {name: differs for name, differs in found.items() if differs > LEAST_DIFFERENCE}


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
    on_paper = _on_paper(candidate, line, _recorded(candidate, line, record))
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
