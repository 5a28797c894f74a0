"""The fit of one hypothesis under the weighting of its own disturbances, and its score.

A hypothesis is a set of effects. Its unknowns ``x`` and the sizes of its disturbances are estimated in turn, each where
the other ended, until the likelihood of the recordings stays: ``x`` by Gauss-Newton steps on the innovations, the sizes
by Fisher scoring. Source: Ljung, System Identification (2nd ed., 1999), chapters 4 and 7: prediction errors of a model
of Box and Jenkins, here with a noise model of physical sizes in place of free polynomials.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from estimator.diagnosis.hypotheses import Effects
from estimator.diagnosis.inference.descent import Effort, descended, extended, light
from estimator.diagnosis.inference.disturbances import (
    Limits,
    estimated,
    minus_twice_log_prior,
    reading_noise,
)
from estimator.diagnosis.inference.moments import moved
from estimator.diagnosis.inference.whitener import Whitener, of_first, readings, whitener_of
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import MOMENT_NAMES, FitResult, not_fitted
from estimator.physics.jacobian import jacobian_at
from estimator.physics.problem import Problem, bounds
from estimator.signals.outputs import by_output
from estimator.signals.record import FloatArray

SAME = 1.0
"""Fall of minus twice the log-likelihood below which another pass over unknowns and disturbances is not made."""

DIGITS = 0.02
"""The same over the difference from a rival that the fit is for."""

MOST_PASSES = 6

THOROUGH, ROUGH = Effort(derivatives=6, steps=30), Effort(derivatives=1, steps=6)
"""What a pass may cost at most, and a first comparison."""

FREE = Effort(derivatives=1, steps=6)
"""What least squares of the free run may cost, from where the likelihood is greatest."""

MOST_ROUGH, MUCH = 3, 0.05
"""Such comparisons under disturbances of their own at most, and the fall of minus twice the log-likelihood per sample
for the next."""

ROUNDS = 2
"""Steps of Fisher scoring in a pass."""

WITH_MOMENTS = 1
"""Passes in which moments of events are looked for elsewhere."""


@dataclass(frozen=True)
class Hypothesis:
    """A set of effects, fitted.

    Attributes
    ----------
    effects : frozenset of str
    plain : FitResult
        Unknowns, simulations and errors; no derivative.
    sizes : ndarray, shape (S,)
        Logarithms of the disturbances' sizes and times (`whitener.Size`).
    limits : Limits
    minus_twice_log : float
        Minus twice the log-likelihood of the recordings, and of the disturbances' prior.
    choices : float
        Logarithm of the number of sets of effects of this size it was chosen among.
    """

    effects: Effects
    plain: FitResult
    sizes: FloatArray
    limits: Limits
    minus_twice_log: float
    choices: float

    @property
    def outputs(self) -> int:
        """How many measured outputs the recordings have: each may have seen the same."""
        return len(readings(self.sizes))

    @property
    def unknowns(self) -> int:
        """How many unknowns were fitted; moments of events only where these act."""
        low, high = bounds(self.plain.problem)
        return int(np.sum(low < high)) - _idle_moments(self.plain)

    @property
    def score(self) -> float:
        """Minus twice the log-likelihood with the price of the unknowns and of the choice (Schwarz, 1978)."""
        n = self.plain.residual.size
        freed = "road_grade" in self.effects
        return self.minus_twice_log + (self.unknowns + freed) * math.log(n) + 2.0 * self.choices

    @cached_property
    def free_squares(self) -> float:
        """The squared free-run error, unknowns as they leave least of it.

        A load that may walk far leaves the noise of the reading: the rest is what it did.
        """
        if "road_grade" in self.effects:
            return float(np.sum(samples_of(self.plain) * reading_noise(self.sizes) ** 2))
        rms = self.plain.rms
        return descended(self.plain, lambda errors: errors / rms, FREE).squares

    @cached_property
    def filter(self) -> Whitener:
        """The filter that whitens errors under the hypothesis' own disturbances."""
        return whitener_of(self.plain, self.sizes)

    @cached_property
    def white(self) -> FitResult:
        """The fit with its errors and their derivative as innovations: independent, of variance 1."""
        plain = self.plain
        known = plain.derivative if plain.converged else None
        derivative = jacobian_at(plain.problem, plain.x, plain.outputs) if known is None else known
        return replace(plain, residual=self.filter(plain.residual), derivative=self.filter(derivative))


def choices_of(effects: Effects, hypotheses: int) -> float:
    """Return the logarithm of the number of sets of so many effects among so many."""
    count = len(effects)
    return math.lgamma(hypotheses + 1) - math.lgamma(count + 1) - math.lgamma(max(hypotheses - count, 0) + 1)


def fitted(
    effects: Effects,
    begun: FitResult,
    sizes: FloatArray,
    limits: Limits,
    hypotheses: int,
    rival: float = math.nan,
) -> Hypothesis:
    """Fit a hypothesis from a free run and disturbances ``sizes``.

    ``rival`` is minus twice the log-likelihood of the hypothesis it will be compared with: the farther from it, the
    less the last digits matter. Without one it is fitted to its end.
    """
    plain, choices, sizes = begun, choices_of(effects, hypotheses), np.clip(sizes, limits.low, limits.high)
    best: Hypothesis | None = None
    passes: list[float] = []
    while best is None or len(passes) < MOST_PASSES:
        plain = descended(plain, whitener_of(plain, sizes), THOROUGH)
        if len(passes) < WITH_MOMENTS:
            plain = _with_moments(plain, sizes)
        sizes, now = _disturbances(plain, sizes, limits, is_anew=not passes)
        enough = SAME if math.isnan(rival) else max(SAME, DIGITS * abs(now - rival))
        last = best is not None and now > best.minus_twice_log - enough
        if best is None or now < best.minus_twice_log:
            best = Hypothesis(effects, plain, sizes, limits, now, choices)
        if last:
            break
        passes.append(now)
    return replace(best, plain=light(best.plain))


def compared(effects: Effects, begun: FitResult, parent: Hypothesis, limits: Limits, hypotheses: int) -> Hypothesis:
    """Fit a hypothesis a few steps from another's disturbances, to be compared with others like it.

    Where it explains much more, other disturbances weigh what is left, and it is fitted a few steps under those, too.
    ``limits`` are those of its own disturbances: a load that may walk far is not every hypothesis'.
    """
    sizes, best = np.clip(parent.sizes, limits.low, limits.high), parent.minus_twice_log
    plain, now = begun, math.inf
    for _ in range(MOST_ROUGH):
        plain = descended(plain, whitener_of(plain, sizes), ROUGH)
        sizes, now = _disturbances(plain, sizes, limits)
        if now > best - MUCH * plain.residual.size:
            break
        best = now
    return Hypothesis(effects, plain, sizes, limits, now, choices_of(effects, hypotheses))


def refitted(hypothesis: Hypothesis, problem: Problem) -> FitResult:
    """Return the fit of a hypothesis to other samples of the same recordings, its disturbances as they are."""
    begun = not_fitted(problem, hypothesis.plain.x)
    return descended(begun, whitener_of(begun, hypothesis.sizes), THOROUGH)


def _disturbances(
    plain: FitResult, sizes: FloatArray, limits: Limits, is_anew: bool = False
) -> tuple[FloatArray, float]:
    return estimated(plain, plain.residual, sizes, limits, ROUNDS, is_anew)


def samples_of(plain: FitResult) -> FloatArray:
    """Return how many samples count of each output, shape (C,)."""
    use = plain.problem.use
    return np.array([sum(int(each.sum()) for each in use[part]) for part in by_output(plain.problem.records)])


def of_first_outputs(hypothesis: Hypothesis) -> Hypothesis:
    """Return what a hypothesis says of the recordings' first outputs alone."""
    plain = hypothesis.plain.first_outputs()
    if plain is hypothesis.plain:
        return hypothesis
    sizes, limits = of_first(hypothesis.sizes), hypothesis.limits.of_first()
    filtered = whitener_of(plain, sizes)
    now = filtered.minus_twice_log(filtered(plain.residual)) + minus_twice_log_prior(sizes, limits)
    return Hypothesis(hypothesis.effects, plain, sizes, limits, now, hypothesis.choices)


def _with_moments(plain: FitResult, sizes: FloatArray) -> FitResult:
    """Return a fit with moments of events where the innovations are least, and fitted from there."""
    if not _has_moments(plain.problem):
        return plain
    for _ in range(2):
        found = moved(plain, whitener_of(plain, sizes))
        if found is None:
            break
        plain = descended(extended(*found, plain), whitener_of(plain, sizes), THOROUGH)
    return plain


def _has_moments(problem: Problem) -> bool:
    return any(u.name in MOMENT_NAMES and u.low < u.high for basis in problem.bases for u in basis.own)


def _idle_moments(plain: FitResult) -> int:
    """Return how many moments are of events that do not take place in their recording."""
    count = 0
    for i, basis in enumerate(plain.problem.bases):
        values = plain.local_of(i)[basis.own_rows]
        own = {(u.effect, u.name): (u, float(v)) for u, v in zip(basis.own, values, strict=True)}
        for name in {u.effect for u in basis.own if EFFECTS[u.effect].event}:
            (begin, from_s), (end, to_s) = own[name, "from_s"], own[name, "to_s"]
            movable = (begin.low < begin.high) + (end.low < end.high)
            if to_s <= from_s:
                count += movable
            else:  # one that begins or ends with the recording has no moment there
                first, last = (float(t) for t in plain.problem.records[i].since_start_s[[0, -1]])
                count += (begin.low < begin.high and from_s <= first) + (end.low < end.high and to_s >= last)
    return count


def covariance(hypothesis: Hypothesis) -> FloatArray:
    """Return the covariance of the scaled unknowns, shape (U, U): the inverse of the Fisher information."""
    white = hypothesis.white
    free = ~white.pinned
    full = np.zeros((white.x.size, white.x.size))
    j = white.jacobian[:, free]
    full[np.ix_(free, free)] = np.linalg.pinv(j.T @ j, hermitian=True)
    return full


def residuals(hypothesis: Hypothesis, stacked: FloatArray) -> Sequence[FloatArray]:
    """Split stacked values into those of each recording."""
    ends = np.cumsum([int(use.sum()) for use in hypothesis.plain.problem.use])[:-1]
    return np.split(stacked, ends)
