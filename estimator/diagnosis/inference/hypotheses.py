"""Hypotheses: sets of effects added to the nominal model, where their fits begin, and their likelihood."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from estimator.diagnosis.black_box import acts_around
from estimator.diagnosis.inference.descent import Effort, descended, extended, without_derivative
from estimator.diagnosis.inference.disturbances import (
    Limits,
    Whitener,
    estimated,
    readings,
    whitener_of,
)
from estimator.diagnosis.inference.moments import has_moments, idle_moments, with_better_moments
from estimator.diagnosis.thresholds import Fitting
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Untestable
from estimator.physics.fit import FitResult
from estimator.physics.jacobian import jacobian_at
from estimator.physics.machine import out_of_question
from estimator.physics.model import DrivelineModel, Motion
from estimator.physics.motion import turns_on
from estimator.physics.problem import bounds
from estimator.signals.record import BoolArray, FloatArray, Record

Effects = frozenset[str]
NOTHING: Effects = frozenset()
GRADE = "road_grade"
"""The effect that is no law: a load that walks further than any load does by itself."""


Progress = Callable[[str, float], None]
"""Called with what is being done and the share of the work behind it; raise from it to cancel."""

THOROUGH, ROUGH = Effort(derivatives=6, steps=30), Effort(derivatives=1, steps=6)
"""What a pass may cost at most, and a first comparison."""


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


def all_good_samples(records: Sequence[Record]) -> list[BoolArray]:
    """Return masks that use every good sample."""
    return [np.asarray(record.okay) for record in records]


@dataclass(frozen=True)
class Hypothesis:
    """A set of effects, fitted."""

    effects: Effects  # names in the set
    result: FitResult  # unknowns, simulations and errors
    sizes: FloatArray  # (S,): logarithms of the disturbances' sizes and times (`whitener.Size`)
    limits: Limits  # usual values and bounds of ``sizes``
    minus_twice_log: float  # minus twice the log-likelihood of the recordings, and of the disturbances' prior
    choices: float  # minus the logarithm of its prior probability (`Catalogue.choices`)

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


def fitted(
    effects: Effects,
    initial: FitResult,
    sizes: FloatArray,
    limits: Limits,
    catalogue: Catalogue,
    rival: float = math.nan,
) -> Hypothesis:
    """Fit a hypothesis from a free run and disturbances ``sizes``.

    ``rival`` is minus twice the log-likelihood of the hypothesis it will be compared with: the farther from it, the
    less the last digits matter. Without one it is fitted to its end.
    """
    result, choices, sizes = initial, catalogue.choices(effects), np.clip(sizes, limits.low, limits.high)
    best: Hypothesis | None = None
    passes: list[float] = []
    while best is None or len(passes) < Fitting.MOST_PASSES:
        result = descended(result, whitener_of(result, sizes), THOROUGH)
        if len(passes) < Fitting.WITH_MOMENTS:
            result = _with_moments(result, sizes)
        is_anew = not passes and math.isnan(rival)  # with a rival they begin where its own ended
        sizes, now = estimated(result, result.residual, sizes, limits, Fitting.ROUNDS, is_anew)
        enough = (
            Fitting.SETTLED_DEVIANCE
            if math.isnan(rival)
            else max(Fitting.SETTLED_DEVIANCE, Fitting.DIGITS * abs(now - rival))
        )
        last = best is not None and now > best.minus_twice_log - enough
        if best is None or now < best.minus_twice_log:
            best = Hypothesis(effects, result, sizes, limits, now, choices)
        if last:
            break
        passes.append(now)
    return replace(best, result=without_derivative(best.result))


def compared(
    effects: Effects, initial: FitResult, parent: Hypothesis, limits: Limits, catalogue: Catalogue
) -> Hypothesis:
    """Fit a hypothesis a few steps from another's disturbances, to be compared with others like it."""
    result, choices, now = initial, catalogue.choices(effects), math.inf
    sizes, best = np.clip(parent.sizes, limits.low, limits.high), parent.minus_twice_log
    for _ in range(Fitting.MOST_ROUGH):
        result = descended(result, whitener_of(result, sizes), ROUGH)
        sizes, now = estimated(result, result.residual, sizes, limits, rounds=1)
        if now > best - Fitting.MUCH * result.residual.size:
            break
        best = now
    return Hypothesis(effects, result, sizes, limits, now, choices)


def _with_moments(result: FitResult, sizes: FloatArray) -> FitResult:
    """Return a fit with moments of events where the innovations are least, and fitted from there."""
    if not has_moments(result.problem):
        return result
    for _ in range(2):
        found = with_better_moments(result, whitener_of(result, sizes))
        if found is None:
            break
        result = descended(extended(*found, result), whitener_of(result, sizes), THOROUGH)
    return result


def covariance(hypothesis: Hypothesis) -> FloatArray:
    """Return the covariance of the scaled unknowns, shape (U, U): the inverse of the Fisher information."""
    white = hypothesis.white
    free = ~white.pinned
    full = np.zeros((white.x.size, white.x.size))
    j = white.jacobian[:, free]
    full[np.ix_(free, free)] = np.linalg.pinv(j.T @ j, hermitian=True)
    return full
