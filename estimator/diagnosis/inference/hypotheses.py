"""Hypotheses: sets of effects added to the nominal model, their likelihood, and whether a machine can be so."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from estimator.diagnosis.black_box import BlackBox
from estimator.diagnosis.inference.disturbances import (
    Limits,
    Size,
    Whitener,
    readings,
    whitener_of,
)
from estimator.diagnosis.line.line import line_values
from estimator.diagnosis.thresholds import Checks
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Effect, Element, Span, Untestable
from estimator.physics.fit import FitResult
from estimator.physics.inputs import shaft_torque
from estimator.physics.jacobian import jacobian_at
from estimator.physics.machine import out_of_question
from estimator.physics.model import DrivelineModel, Motion
from estimator.physics.motion import longest_s, turns_on
from estimator.physics.problem import bounds
from estimator.physics.steps import has_edge
from estimator.signals.record import BoolArray, FloatArray, Record

Effects = frozenset[str]
NOTHING: Effects = frozenset()
GRADE = "road_grade"
"""The effect that is no law: a load that walks further than any load does by itself."""


Progress = Callable[[str, float], None]
"""Called with what is being done and the share of the work behind it; raise from it to cancel."""


def silent(_message: str, _share: float) -> None:
    """Report nothing."""


def open_hypotheses(model: DrivelineModel, records: Sequence[Record]) -> tuple[tuple[str, ...], dict[str, Untestable]]:
    """Sort the catalogue into effects that the recordings can tell and those they can't, with the reason.

    Effects that make no sense in the model's structure or for such a motion, of parts that the machine has not, that
    act inside a plant simulated elsewhere, or that the model already has, are in neither.
    """
    testable, untestable = [], {}
    impossible = out_of_question(model.has, records)
    for name in (*EFFECTS, *model.laws):
        entry = EFFECTS[name]
        fits = model.structure in entry.structures and all(record.kind in entry.kinds for record in records)
        turns = model.motion is Motion.ROTATION or not entry.phases
        swings = not (entry.swinging and turns_on(records))
        reached = model.plant is None or acts_around(entry, model.plant)
        possible = fits and turns and swings and reached and name not in impossible
        if not possible or name in model.effects or entry.recognised:
            continue
        obstacle = entry.testable(model, records)
        if obstacle is None:
            testable.append(name)
        else:
            untestable[name] = obstacle
    return tuple(testable), untestable


def acts_around(entry: Effect, plant: object) -> bool:
    """Tell whether an effect acts at the inputs, shafts or outputs of a plant, whatever is inside it."""
    if isinstance(plant, BlackBox) and entry.name in plant.laws:
        return True
    return entry.profile or entry.element in (Element.TORQUE_PATH, Element.SPEED_SENSOR, Element.ACQUISITION)


def all_good_samples(records: Sequence[Record]) -> list[BoolArray]:
    """Return masks that use every good sample."""
    return [np.asarray(record.okay) for record in records]


def idle_moments(result: FitResult) -> int:
    """Return how many moments are of events that do not take place in their recording."""
    count = 0
    for i, basis in enumerate(result.problem.bases):
        values = result.local_of(i)[basis.own_rows]
        own = {(u.effect, u.name): (u, float(v)) for u, v in zip(basis.own, values, strict=True)}
        for name in {u.effect for u in basis.own if EFFECTS[u.effect].event}:
            (begin, from_s), (end, to_s) = own[name, "from_s"], own[name, "to_s"]
            movable = (begin.low < begin.high) + (end.low < end.high)
            if to_s <= from_s:
                count += movable
            else:  # one that begins or ends with the recording has no moment there
                first, last = (float(t) for t in result.problem.records[i].since_start_s[[0, -1]])
                count += (begin.low < begin.high and from_s <= first) + (end.low < end.high and to_s >= last)
    return count


@dataclass(frozen=True)
class Hypothesis:
    """A set of effects, fitted."""

    effects: Effects  # names in the set
    result: FitResult  # unknowns, simulations and errors
    sizes: FloatArray  # (S,): logarithms of the disturbances' sizes and times (`whitener.Size`)
    limits: Limits  # usual values and bounds of ``sizes``
    minus_twice_log: float  # minus twice the log-likelihood of the recordings, and of the disturbances' prior
    choices: float  # minus the logarithm of its prior probability (`Catalogue.choices`)
    is_plausible: bool = True  # whether a machine can be so, and its values are a case of each effect

    @property
    def outputs(self) -> int:
        """How many measured outputs the recordings have: each may have seen the same."""
        return len(readings(self.sizes))

    @property
    def unknowns(self) -> int:
        """How many unknowns were fitted; moments of events only where these act."""
        low, high = bounds(self.result.problem)
        return int(np.sum(low < high)) - idle_moments(self.result)

    @property
    def score(self) -> float:
        """Minus twice the log-likelihood with the price of the unknowns and of the choice (Schwarz, 1978)."""
        n = self.result.residual.size
        freed = GRADE in self.effects
        return self.minus_twice_log + (self.unknowns + freed) * math.log(n) + 2.0 * self.choices

    @cached_property
    def filter(self) -> Whitener:
        """The filter that whitens errors under the hypothesis' own disturbances."""
        return whitener_of(self.result, self.sizes)

    @cached_property
    def white(self) -> FitResult:
        """The fit with its errors and their derivative as innovations: independent, of variance 1."""
        result = self.result
        known = result.derivative if result.converged else None
        derivative = jacobian_at(result.problem, result.x, result.outputs) if known is None else known
        return replace(result, residual=self.filter(result.residual), derivative=self.filter(derivative))


@dataclass(frozen=True, slots=True)
class Catalogue:
    """What a set of effects is chosen among, and what is known of it before any recording is seen."""

    model: DrivelineModel  # nominal
    effects: int  # how many these recordings can show
    odds: Mapping[str, float] = field(default_factory=dict)  # of those that the user has given odds, p / (1 - p)

    def choices(self, effects: Effects) -> float:
        """Return minus the logarithm of a set's prior probability, up to what all sets have in common.

        Sets of a size are as probable as each other, and so are all sizes together (Scott and Berger, Ann. Statist. 38,
        2010), but for the effects that have odds of their own.
        """
        given = [name for name in effects if name in self.odds]
        count, among = len(effects) - len(given), self.effects - len(given)
        usual = math.lgamma(among + 1) - math.lgamma(count + 1) - math.lgamma(max(among - count, 0) + 1)
        return usual - sum(math.log(max(self.odds[name], 1e-300)) for name in given)


def hypothesis_of(
    effects: Effects, result: FitResult, sizes: FloatArray, limits: Limits, minus_twice_log: float, catalogue: Catalogue
) -> Hypothesis:
    """Return a set that was fitted, with its prior and whether a machine can be so."""
    found = Hypothesis(effects, result, sizes, limits, minus_twice_log, catalogue.choices(effects))
    return replace(found, is_plausible=is_plausible(found, catalogue.model, result.problem.records))


def is_possible(hypothesis: Hypothesis, records: Sequence[Record]) -> bool:
    """Tell whether a machine can be so: its input is on, it is not stuck, no load walks so far, events take place."""
    values, result = _values_of(hypothesis), hypothesis.result
    if GRADE in hypothesis.effects and _walk(hypothesis, records) > _most_torque(records):
        return False
    edges = all(has_edge(name, result) for name in values if EFFECTS[name].event)
    return edges and _is_driven(result, records) and not _is_stuck(values, records)


def is_plausible(hypothesis: Hypothesis, model: DrivelineModel, records: Sequence[Record]) -> bool:
    """Tell whether a machine can be so, and the values of every effect are a case of it."""
    values = _values_of(hypothesis)
    if any(EFFECTS[name].implausible(model, records, values[name]) for name in values):
        return False
    return is_possible(hypothesis, records) and _is_described(hypothesis, model)


def _values_of(hypothesis: Hypothesis) -> dict[str, Mapping[str, float]]:
    return {name: hypothesis.result.values_of(name) for name in hypothesis.effects - {GRADE}}


def spans_of(hypothesis: Hypothesis, model: DrivelineModel) -> dict[str, list[Span]]:
    """Return where data sheets' values of nominal parameters may lie that the effects change, by name."""
    result, found = hypothesis.result, dict[str, list[Span]]()
    line = line_values(result)
    for name in hypothesis.effects - {GRADE}:
        for parameter, spans in EFFECTS[name].described(model, result.values_of(name), line).items():
            found.setdefault(parameter, []).extend(spans)
    return found


def _is_described(hypothesis: Hypothesis, model: DrivelineModel) -> bool:
    """Tell whether every nominal value is, within its tolerance, one that the line had at some moment."""
    spans_by_name, line = spans_of(hypothesis, model), line_values(hypothesis.result)
    for name, spans in spans_by_name.items():
        given = model.parameters[name]
        low, high = (given.value * (1.0 + sign * (given.tolerance + Checks.ROUNDING)) for sign in (-1.0, 1.0))
        if not any(first <= high and low <= last for first, last in [*spans, (line[name], line[name])]):
            return False
    return True


def _is_driven(result: FitResult, records: Sequence[Record]) -> bool:
    for i, record in enumerate(records):
        through = shaft_torque(record.torque_nm, record.time_s - record.time_s[0], result.p_of(i))
        for passed, read in zip(
            np.array_split(through, Checks.PARTS), np.array_split(record.total_torque_nm, Checks.PARTS), strict=True
        ):
            if float(passed @ passed) < Checks.LEAST_THROUGH**2 * float(read @ read):
                return False
    return True


def _walk(hypothesis: Hypothesis, records: Sequence[Record]) -> float:
    """Return how far a load walks in the longest recording [Nm]."""
    return float(np.exp(hypothesis.sizes[Size.WALK])) * math.sqrt(longest_s(records))


def _most_torque(records: Sequence[Record]) -> float:
    return max(float(np.abs(record.total_torque_nm).max()) for record in records)


def _is_stuck(values: Mapping[str, Mapping[str, float]], records: Sequence[Record]) -> bool:
    """Tell whether a torque against the motion is above all torque that was applied; where it swings it need not be."""
    most = _most_torque(records)
    return any(
        values[name].get(parameter.name, 0.0) > most
        for name in values
        if EFFECTS[name].element in (Element.MOTOR, Element.LOAD) and not EFFECTS[name].swinging
        for parameter in EFFECTS[name].parameters
        if parameter.dimension == "torque" and parameter.null == 0.0  # that of a limit is beyond all torque
    )
