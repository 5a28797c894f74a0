"""How a set of effects is fitted: its unknowns and its disturbances in turn, and moments of events elsewhere.

The unknowns are found by Gauss-Newton descent of the squared innovations, with derivatives that are carried from fit to
fit. A derivative by differences costs a simulation per unknown, a step one. So a fit begins with the derivative of the
fit it extends, of which only the new unknowns' columns are found, and follows it by Broyden's update (Math. Comp. 19,
1965; with Marquardt's damping: Madsen, Nielsen and Tingleff, Methods for Non-Linear Least Squares Problems, DTU 2004,
3.5). It is found anew where a step does not keep what it promised, and before a fit counts as ended. Derivatives are
those of the plain errors: they hold under any weighting.

The squared innovations have a minimum near every edge that an event may begin or end at, and a descent finds the
nearest. So the likelihood is looked at elsewhere in the whole recording, all else as a fit has it
(`with_better_moments`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.inference.disturbances import Limits, Whitener, estimated, whitener_of
from estimator.diagnosis.inference.hypotheses import Catalogue, Effects, Hypothesis, hypothesis_of
from estimator.diagnosis.thresholds import Fitting
from estimator.least_squares import damped_step
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import MOMENT_NAMES, FitResult, in_common
from estimator.physics.jacobian import changes, jacobian_at
from estimator.physics.problem import Problem, bounds, outputs_at, own_part, residual_at, simulated_each
from estimator.physics.unknowns import LocalBasis
from estimator.signals.record import FloatArray, Record

Weigh = Callable[[FloatArray], FloatArray]

FIRST_DAMPING = 1e-3
EASE, STIFFEN = 0.2, 5.0
LEAST_DAMPING, MOST_DAMPING = 1e-10, 1e8

_OFFSETS_S = np.array([0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.6, 1.2, 2.4, 5.0, 10.0])
OFFSETS_S = np.concatenate([-_OFFSETS_S[::-1], _OFFSETS_S])
"""Where else the likelihood is looked at, around the moment a fit ended at; and at the recording's own ends."""

MUCH_BYTES = 2**25  # room of a derivative that is rather found again than kept with a fit that is over


@dataclass(frozen=True, slots=True)
class Effort:
    """How much a descent may cost: derivatives found anew, and steps."""

    derivatives: int  # how often they are found anew at most
    steps: int  # at most


THOROUGH = Effort(derivatives=6, steps=30)
"""What a pass of a fit to its end may cost at most."""


@dataclass(frozen=True, slots=True)
class Depth:
    """How far a set is fitted: passes over its unknowns and its disturbances in turn."""

    effort: Effort  # of the descent in each pass
    passes: int  # at most
    with_moments: int  # passes in which moments of events are looked for elsewhere
    rounds: int  # of Fisher scoring, in which a pass estimates the disturbances
    is_rough: bool = False  # whether it only has to be compared with others like it

    def is_settled(self, before: float, now: float, samples: int, rival: float) -> bool:
        """Tell whether minus twice the log-likelihood fell too little for another pass.

        The farther a fit to its end is from what it will be compared with, the less its last digits matter.
        """
        if self.is_rough:
            return now > before - Fitting.MUCH * samples
        digits = 0.0 if math.isnan(rival) else Fitting.DIGITS * abs(now - rival)
        return now > before - max(Fitting.SETTLED_DEVIANCE, digits)


ROUGH = Depth(Effort(derivatives=1, steps=6), passes=Fitting.MOST_ROUGH, with_moments=0, rounds=1, is_rough=True)
WHOLE = Depth(THOROUGH, passes=Fitting.MOST_PASSES, with_moments=Fitting.WITH_MOMENTS, rounds=Fitting.ROUNDS)
"""A first comparison, and a fit that decides."""


@dataclass(frozen=True, slots=True)
class Start:
    """Where a fit of a set begins."""

    initial: FitResult  # free run there, with what is known of its derivative
    sizes: FloatArray  # of the disturbances
    limits: Limits  # bounds of these
    rival: float = math.nan
    """Minus twice the log-likelihood of the set with which it will be compared; nan where there is none."""


def fitted(effects: Effects, start: Start, depth: Depth, catalogue: Catalogue) -> Hypothesis:
    """Fit a set of effects from a start: the best of some passes."""
    result, sizes = start.initial, np.clip(start.sizes, start.limits.low, start.limits.high)
    best, least, before = (result, sizes), math.inf, start.rival if depth.is_rough else math.inf
    for done in range(depth.passes):
        result = descended(result, whitener_of(result, sizes), depth.effort)
        if done < depth.with_moments:
            result = _with_moments(result, sizes, depth.effort)
        is_anew = done == 0 and math.isnan(start.rival)  # with a rival they begin where its own ended
        sizes, now = estimated(result, result.residual, sizes, start.limits, depth.rounds, is_anew)
        if now < least:
            best, least = (result, sizes), now
        if depth.is_settled(before, now, result.residual.size, start.rival):
            break
        before = least
    result, sizes = best
    ended = result if depth.is_rough else without_derivative(result)  # a rough fit may yet continue
    return hypothesis_of(effects, ended, sizes, start.limits, least, catalogue)


def _with_moments(result: FitResult, sizes: FloatArray, effort: Effort) -> FitResult:
    """Return a fit with moments of events where the innovations are least, and fitted from there."""
    if not has_moments(result.problem):
        return result
    for _ in range(2):
        found = with_better_moments(result, whitener_of(result, sizes))
        if found is None:
            break
        result = descended(extended(*found, result), whitener_of(result, sizes), effort)
    return result


def covariance_of_innovations(hypothesis: Hypothesis) -> FloatArray:
    """Return the covariance of the scaled unknowns, shape (U, U): the inverse of the Fisher information."""
    white = hypothesis.white
    free = ~white.pinned
    full = np.zeros((white.x.size, white.x.size))
    j = white.jacobian[:, free]
    full[np.ix_(free, free)] = np.linalg.pinv(j.T @ j, hermitian=True)
    return full


def extended(problem: Problem, x: FloatArray, previous: FitResult, anew: str = "") -> FitResult:
    """Return the free run of a problem at ``x`` with the derivative of a fit with which it has unknowns in common.

    The columns of the others are found, and those of the parameters of an effect that starts ``anew``.
    """
    low, high = bounds(problem)
    x = np.clip(x, low, high)
    outputs = outputs_at(problem, x)
    initial = FitResult(problem, x, outputs, residual_at(problem, outputs), None, False)
    if previous.derivative is None or previous.derivative.shape[0] != initial.residual.size:
        return initial
    columns, taken, ratio = in_common(problem, previous.problem)
    known = previous.derivative[:, taken].any(axis=0)  # what was held there, and is free here, is not known
    known &= ~np.isin(columns, [i for i, shared in enumerate(problem.shared) if anew and shared.effect == anew])
    columns, taken, ratio = columns[known], taken[known], ratio[known]
    new = low < high
    new[columns] = False
    derivative = jacobian_at(problem, x, outputs, new) if new.any() else np.zeros((initial.residual.size, x.size))
    derivative[:, columns] = previous.derivative[:, taken] * (ratio * (low < high)[columns])
    return replace(initial, derivative=derivative)


def without_derivative(fit: FitResult) -> FitResult:
    """Return a fit that is over, without a derivative that takes much room."""
    return fit if fit.derivative is None or fit.derivative.nbytes <= MUCH_BYTES else fit.without_derivative()


def descended(initial: FitResult, weigh: Weigh, effort: Effort) -> FitResult:
    """Return the unknowns at which the squared innovations under fixed disturbances are least."""
    descent = _Descent(initial, weigh, effort.derivatives)
    for _ in range(effort.steps):
        if not descent.step():
            break
    return descent.result


class _Descent:
    """One descent: where it is, its derivative, how it is damped, and what it may still spend."""

    def __init__(self, initial: FitResult, weigh: Weigh, derivatives: int) -> None:
        self._problem, self._weigh, self._left = initial.problem, weigh, derivatives
        self._low, self._high = bounds(initial.problem)
        self._x = np.clip(initial.x, self._low, self._high)
        self._outputs, self._errors, self._derivative = initial.outputs, initial.residual, initial.derivative
        self._innovations = weigh(self._errors)
        self._fresh = initial.converged and initial.derivative is not None
        self._damping, self._converged = FIRST_DAMPING, False

    @property
    def result(self) -> FitResult:
        return FitResult(self._problem, self._x, self._outputs, self._errors, self._derivative, self._converged)

    def step(self) -> bool:
        """Take a step, and tell whether there may be another."""
        derivative = self._found_derivative()
        if derivative is None:
            return False
        white = self._weigh(derivative)
        gradient, curvature = white.T @ self._innovations, white.T @ white
        while True:
            moved = damped_step(self._x, gradient, curvature, self._damping, self._low, self._high)
            promise = float(-moved @ (2.0 * gradient + curvature @ moved))
            if promise < Fitting.LITTLE:
                self._converged = self._fresh
                return not self._fresh and self._find_derivative()
            gained = self._try(moved)
            if gained > 0.0:
                self._damping = max(self._damping * EASE, LEAST_DAMPING)
                self._fresh = self._fresh and Fitting.LEAST_SHARE_OF_PROMISE * promise <= gained < Fitting.NEAR
                return gained >= Fitting.LEAST_SHARE_OF_PROMISE * promise or self._left == 0 or self._find_derivative()
            if not self._fresh:
                return self._find_derivative()
            self._damping *= STIFFEN
            if self._damping >= MOST_DAMPING:
                self._converged = True
                return False

    def _found_derivative(self) -> FloatArray | None:
        if self._derivative is None:
            self._find_derivative()
        return self._derivative

    def _find_derivative(self) -> bool:
        if self._left == 0:
            return False
        self._left -= 1
        self._derivative, self._fresh = jacobian_at(self._problem, self._x, self._outputs), True
        return True

    def _try(self, moved: FloatArray) -> float:
        """Go there where the squared innovations fall, carry the derivative along, and return by how much they fall."""
        x = self._x + moved
        outputs = outputs_at(self._problem, x)
        errors = residual_at(self._problem, outputs)
        innovations = self._weigh(errors)
        with np.errstate(over="ignore"):
            gained = float(self._innovations @ self._innovations) - float(innovations @ innovations)
        if gained > 0.0 and self._derivative is not None:
            missed = (errors - self._errors - self._derivative @ moved) / (moved @ moved)
            self._derivative = self._derivative + np.outer(missed, moved)
            self._x, self._outputs, self._errors, self._innovations = x, outputs, errors, innovations
        return gained


def with_better_moments(result: FitResult, filtered: Whitener) -> tuple[Problem, FloatArray] | None:
    """Return a problem and its unknowns with moments where the innovations are less; None where they are nowhere.

    A fit may move them from there as far as it could before.
    """
    problem, x, better = result.problem, result.x.copy(), False
    bases = list(problem.local)
    for i, basis in enumerate(problem.bases):
        local = _moved_in(result, filtered, i)
        if local is not None:
            x[own_part(problem, i)], better = local, True
            bases[i] = _around(basis, local, problem.records[i])
    return (replace(problem, local=tuple(bases[lead] for lead in problem.leads)), x) if better else None


def _around(basis: LocalBasis, local: FloatArray, record: Record) -> LocalBasis:
    """Return a basis with the bounds of movable moments as wide as before, around where they are."""
    first, last = (float(each) for each in record.since_start_s[[0, -1]])
    last += record.sample_time_s
    own = []
    for row, unknown in enumerate(basis.own, start=basis.own_rows.start):
        if EFFECTS[unknown.effect].event and unknown.low < unknown.high:
            at, reach = float(local[row]), 0.5 * (unknown.high - unknown.low)
            unknown = replace(unknown, start=at, low=max(first, at - reach), high=min(last, at + reach))
        own.append(unknown)
    return replace(basis, own=tuple(own))


def _moved_in(result: FitResult, filtered: Whitener, index: int) -> FloatArray | None:
    basis, local = result.problem.local[index], result.local_of(index).copy()
    ends = _ends(basis)
    if not ends:
        return None
    taken_up = _initial_state(result, filtered, index)
    began = best = float(_squares(result, filtered, index, taken_up, [local])[0])
    first, last = (float(each) for each in result.problem.records[index].since_start_s[[0, -1]])
    for begin, end in ends:
        may_move = [row for row in (begin, end) if basis.low[row] < basis.high[row]]
        sets = [[row] for row in may_move] + ([may_move] if len(may_move) > 1 else [])
        for _ in range(Fitting.MOVES):
            tried = [_shifted(local, rows, offset) for rows in sets for offset in OFFSETS_S]
            tried += [_shifted(local, [row], {begin: first, end: last}[row] - local[row]) for row in may_move]
            tried = [each for each in tried if first <= each[begin] <= each[end] <= max(last, local[end])]
            if not tried:
                break
            squares = _squares(result, filtered, index, taken_up, tried)
            if squares.min() >= best:
                break
            best, local = float(squares.min()), tried[int(squares.argmin())]
    return local if best < began - Fitting.WORTH_MOVING else None


def _shifted(local: FloatArray, rows: list[int], offset_s: float) -> FloatArray:
    x = local.copy()
    x[rows] += offset_s
    return x


def _ends(basis: LocalBasis) -> list[tuple[int, int]]:
    """Return where beginning and end of each event stand among a recording's unknowns."""
    place = {(u.effect, u.name): row for row, u in enumerate(basis.own, start=basis.own_rows.start)}
    movable = {u.effect for u in basis.own if EFFECTS[u.effect].event and u.low < u.high}
    return [(place[effect, "from_s"], place[effect, "to_s"]) for effect in sorted(movable)]


def _initial_state(result: FitResult, filtered: Whitener, index: int) -> FloatArray:
    """Return an orthonormal basis of what load torque and initial state do to the innovations."""
    first = own_part(result.problem, index).start
    columns = np.arange(first, first + result.problem.local[index].own_rows.start)
    return np.linalg.qr(filtered.part(index, changes(result.problem, result.x, index, columns, result.outputs)))[0]


def _squares(
    result: FitResult, filtered: Whitener, index: int, taken_up: FloatArray, tried: list[FloatArray]
) -> FloatArray:
    """Return the squared innovations for each of several vectors that differ in moments, shape (K,)."""
    problem = result.problem
    measured = np.concatenate([problem.records[i].output[problem.use[i]] for i in problem.drives[index]])
    outputs = simulated_each(problem, [(result.p, x) for x in tried], index)
    errors = filtered.part(index, (outputs - measured).T).T
    return (errors**2).sum(axis=1) - ((errors @ taken_up) ** 2).sum(axis=1)


def has_moments(problem: Problem) -> bool:
    """Tell whether a fit may move the moment of an event."""
    return any(u.name in MOMENT_NAMES and u.low < u.high for basis in problem.bases for u in basis.own)
