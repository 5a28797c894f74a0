"""Nonlinear least squares for long residuals and few unknowns: a projected Levenberg-Marquardt method.

``scipy.optimize.least_squares`` decomposes the whole Jacobian at every step; with ten thousand errors and twenty
unknowns that costs more than the simulations that made it. Its ``method="lm"`` also reads one number behind the
Jacobian where a column all but depends on the others (SciPy 1.17, ``qrfac``): the last bits of its answer follow what
happens to lie there in memory. Here the step comes from the normal equations and is the least of the damped quadratic
inside the bounds (`damped_step`). How much is damped is one of two rules:

- `Marquardt` (SIAM J. Appl. Math. 11, 1963) for simulations, whose unknowns have bounds;
- `TrustRegion` (J. J. Moré, Lecture Notes in Mathematics 630, 1978), MINPACK's, for transfer functions. Their squared
  error has long curved valleys, out of which Marquardt's rule led to a worse minimum nearly twice as often.

Near the end, where steps keep what they promise, the Jacobian is carried on by Broyden's update (Math. Comp. 19, 1965;
with Marquardt's method: Madsen, Nielsen and Tingleff, Methods for Non-Linear Least Squares Problems, DTU 2004, 3.5): it
costs a simulation per unknown, a step one. A fit ends a last small step from a Jacobian found anew.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from scipy.optimize import lsq_linear

from estimator.compiled import compiled
from estimator.signals.correlation import effective_samples
from estimator.signals.record import BoolArray, FloatArray, IntArray

TINY = 1e-12  # room that a bound always leaves: an interval of no length is none
EXCHANGES = 10  # exchanges after which pivoting is taken to go round in circles

CONVERGED = 0.1
"""A step that promises less than this in log-likelihood ratio, ``n dS/S``, changes no conclusion: it is the last."""

MOST_AS_ONE = 30.0
"""Correlated errors of which one counts in n, at most.

What a wrong law leaves keeps its sign for long. Along a valley that leads nowhere its fit would continue for a part of
the error that chance alone moves further. But where all of the error is such, a plateau on the way looks like the end.
"""

RELIABLE = 0.75
"""Share of a step's promise that it must keep for the derivative to be carried on to the next and not found again."""

FAR = 0.2
"""Share of the squared error that such a step takes away at most: far from the end the derivative is soon another."""

FIRST_DAMPING = 1e-3
EASE, STIFFEN = 0.2, 5.0
LEAST_DAMPING, MOST_DAMPING = 1e-10, 1e9

UNDAMPED = 1e-12
"""Damping of a step of full length: keeps the curvature of a column that depends on others from being singular."""

ROOM = 0.1  # relative, by which a step may be longer or shorter than the radius
SEARCHES = 12  # for the damping of one step; three or four do
HALF_KEPT, MOSTLY_KEPT = 0.25, 0.75  # shares of its promise: a step that keeps less shrinks the radius, more doubles it
SHORTEST = 1e-8  # radius, against the length of all unknowns, that moves nothing any more


def unbounded_first(low: FloatArray, high: FloatArray, among: BoolArray) -> IntArray:
    """Return the indices of some unknowns, those without any bound first; otherwise in order."""
    chosen = np.flatnonzero(among)
    return chosen[np.argsort(_bounded(low[chosen], high[chosen]), kind="stable")]


def least_inside(triangle: FloatArray, target: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the least of ``|triangle @ x - target|`` with ``low <= x <= high``, shape (U,)."""
    free = int(_bounded(low, high).argmax())
    x, ended = least(np.ascontiguousarray(triangle), target, low, high, free, EXCHANGES)
    if not ended:
        rest = slice(free, None)
        x[rest] = _one_by_one(triangle[rest, rest], target[rest], low[rest], high[rest])
        x[:free] = substituted(triangle[:free, :free], target[:free] - triangle[:free, rest] @ x[rest])
    return x


def least_of_quadratic(curvature: FloatArray, gradient: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the least of ``x' curvature x / 2 + gradient' x`` with ``low <= x <= high``, shape (U,)."""
    if not _bounded(low, high).any():
        return np.asarray(-np.linalg.solve(curvature, gradient), dtype=np.float64)
    return least_inside(*_factored(curvature, gradient), low, high)


@compiled
def _factored(curvature: FloatArray, gradient: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return triangle and target of a quadratic: its least is that of ``|triangle @ x - target|``."""
    lower = np.linalg.cholesky(curvature)
    target = np.empty_like(gradient)
    for i in range(target.size):
        left = -gradient[i]
        for j in range(i):
            left -= lower[i, j] * target[j]
        target[i] = left / lower[i, i]
    return np.ascontiguousarray(lower.T), target


@compiled
def least(
    triangle: FloatArray, target: FloatArray, low: FloatArray, high: FloatArray, free: int, exchanges: int
) -> tuple[FloatArray, bool]:
    """Return the least and whether pivoting came to an end, of unknowns of which the first ``free`` have no bounds."""
    x = substituted(triangle, target)
    if not np.any((x < low) | (x > high)):
        return x, True
    rest = np.ascontiguousarray(triangle[free:, free:])
    x[free:], ended = _pivoted(rest, target[free:], low[free:], high[free:], exchanges)
    across = np.ascontiguousarray(triangle[:free, free:])
    x[:free] = substituted(triangle[:free, :free], target[:free] - across @ x[free:])
    return x, ended


@compiled
def substituted(triangle: FloatArray, target: FloatArray) -> FloatArray:
    """Return x with ``triangle @ x = target``, of an upper triangle."""
    x = np.empty_like(target)
    for i in range(x.size - 1, -1, -1):
        left = target[i]
        for j in range(i + 1, x.size):
            left -= triangle[i, j] * x[j]
        x[i] = left / triangle[i, i]
    return x


@compiled
def _pivoted(
    triangle: FloatArray, target: FloatArray, low: FloatArray, high: FloatArray, exchanges: int
) -> tuple[FloatArray, bool]:
    """Return the least by block principal pivoting, and whether that came to an end."""
    curvature, slope = triangle.T @ triangle, triangle.T @ target
    down, up, x = np.zeros(low.size, np.bool_), np.zeros(low.size, np.bool_), np.zeros(low.size)
    for _ in range(exchanges):
        free = ~(down | up)
        x = np.where(down, low, np.where(up, high, 0.0))
        which = np.flatnonzero(free)
        if which.size > 0:
            x[which] = np.linalg.lstsq(triangle[:, which], target - triangle @ x)[0]  # two may be alike
        pull = slope - curvature @ x  # where the error would fall
        inward = (down & (pull > 0.0)) | (up & (pull < 0.0))
        below, above = free & (x < low), free & (x > high)
        if not np.any(inward | below | above):
            return x, True
        down, up = (down & ~inward) | below, (up & ~inward) | above
    return x, False


def _one_by_one(triangle: FloatArray, target: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    inside: FloatArray = lsq_linear(triangle, target, (low, high + TINY), method="bvls").x
    return np.clip(inside, low, high)


def _bounded(low: FloatArray, high: FloatArray) -> BoolArray:
    return np.isfinite(low) | np.isfinite(high)


@dataclass(frozen=True, slots=True)
class Solution:
    """Where a fit ended: unknowns (U,), errors (R,), Jacobian there, or one last small step before (R, U)."""

    x: FloatArray  # scaled, at the minimum
    residual: FloatArray  # errors there
    jacobian: FloatArray | None  # None where none was made
    converged: bool  # whether the last step promised too little to matter
    stuck: bool = False  # whether no step, however short, made the error smaller


class Damping(Protocol):
    """A rule for how much a step is damped: it learns from how the steps turn out."""

    def step(
        self, x: FloatArray, gradient: FloatArray, curvature: FloatArray, low: FloatArray, high: FloatArray
    ) -> FloatArray:
        """Return the step (U,) to be tried."""

    def learn(self, x: FloatArray, slope: float, promise: float, gained: float) -> bool:
        """Learn what the last step gained, ``slope`` being gradient times step; tell whether one may be shorter."""


@dataclass(slots=True)
class Marquardt:
    """Damping that is eased by a step that is taken and stiffened by one that is refused."""

    damping: float = FIRST_DAMPING  # of the next step, in parts of the curvature's diagonal

    def step(
        self, x: FloatArray, gradient: FloatArray, curvature: FloatArray, low: FloatArray, high: FloatArray
    ) -> FloatArray:
        """Return the step (U,) to be tried."""
        return damped_step(x, gradient, curvature, self.damping, low, high)

    def learn(self, x: FloatArray, slope: float, promise: float, gained: float) -> bool:
        """Ease or stiffen; tell whether the damping is not the most yet."""
        self.damping = max(self.damping * EASE, LEAST_DAMPING) if gained > 0.0 else self.damping * STIFFEN
        return self.damping < MOST_DAMPING


@dataclass(slots=True)
class TrustRegion:
    """Damping that holds a step within a radius, which follows what the steps keep of their promise.

    Lengths are in units of the largest norm that each column of the Jacobian has had so far.
    """

    radius: float = np.inf  # of the next step
    length: float = 0.0  # of the last one
    damping: float = UNDAMPED  # of the last one, in parts of the scale
    scale: FloatArray = field(default_factory=lambda: np.zeros(1))  # (U,), the columns' largest squared norms

    def step(
        self, x: FloatArray, gradient: FloatArray, curvature: FloatArray, low: FloatArray, high: FloatArray
    ) -> FloatArray:
        """Return the step (U,) to be tried: undamped if that is short enough, otherwise as long as the radius."""
        self.scale = _floored(np.maximum(self.scale, np.diag(curvature)))

        def damped(damping: float) -> FloatArray:
            self.damping = damping
            found = damped_step(x, gradient, curvature, damping, low, high, self.scale)
            self.length = float(np.sqrt(self.scale @ found**2))
            return found

        last, step = self.damping, damped(UNDAMPED)
        if self.length <= (1.0 + ROOM) * self.radius:
            return step
        least, below, above, was_long = UNDAMPED, 1.0 / self.length, 0.0, True
        most = float(np.sqrt(np.sum(gradient**2 / self.scale))) / self.radius  # there a step is surely short enough
        damping = last if least < last < most else np.sqrt(least * most)
        for _ in range(SEARCHES):
            step = damped(float(damping))
            if abs(self.length - self.radius) <= ROOM * self.radius:
                break
            is_long = self.length > self.radius
            if is_long:
                least, below = damping, 1.0 / self.length
            else:
                most, above = damping, 1.0 / self.length
            # The inverse of the length is linear in the damping, but for columns that all but depend on others.
            share = (1.0 / self.radius - below) / (above - below) if above else 0.0
            damping = least + share * (most - least) if above and is_long != was_long else np.sqrt(least * most)
            was_long = is_long
        return step

    def learn(self, x: FloatArray, slope: float, promise: float, gained: float) -> bool:
        """Follow with the radius, as MINPACK does; tell whether it still moves anything."""
        radius = min(self.radius, 10.0 * self.length) if np.isfinite(self.radius) else self.length
        if not gained > HALF_KEPT * promise:  # to where a parabola through both ends has its least
            self.radius = radius * (0.5 if gained >= 0.0 else max(0.1, slope / (2.0 * slope + gained)))
        elif self.damping == UNDAMPED or gained >= MOSTLY_KEPT * promise:
            self.radius = 2.0 * self.length
        return self.radius > SHORTEST * float(np.sqrt(self.scale @ x**2))


def minimise(
    residual: Callable[[FloatArray], FloatArray],
    jacobian: Callable[[FloatArray], FloatArray],
    x0: FloatArray,
    low: FloatArray,
    high: FloatArray,
    iterations: int = 50,
    smooth: bool = True,
    settled: float = 0.0,
    damping: Damping | None = None,
) -> Solution:
    """Minimise ``sum(residual(x)**2)`` subject to ``low <= x <= high`` from one start.

    Parameters
    ----------
    residual, jacobian : callable
        Unknowns (U,) to errors (R,), and to their derivative (R, U).
    x0, low, high : ndarray
        Start and bounds, shape (U,).
    iterations : int
        Jacobians at most.
    smooth : bool
        Whether a Jacobian may be carried on by Broyden's update.
    settled : float
        Relative fall of the squared error that is too little to continue for; 0: what chance alone would bring.
    damping : Damping, optional
        The rule for the length of a step; Marquardt's by default.
    """
    x, damping = np.clip(x0, low, high), damping or Marquardt()
    errors = residual(x)
    for _ in range(iterations):
        derivative, fresh, refused = jacobian(x), True, False
        gradient, curvature = derivative.T @ errors, derivative.T @ derivative
        while True:
            square = float(errors @ errors)
            step = damping.step(x, gradient, curvature, low, high)
            promise = float(-step @ (2.0 * gradient + curvature @ step))
            if promise <= settled * square if settled else _is_little(promise, square, errors):
                if not fresh:
                    break
                tried = residual(x + step)
                x, errors = (x + step, tried) if _gained(errors, tried) > 0.0 else (x, errors)
                return Solution(x, errors, derivative, True, stuck=refused)
            tried = residual(x + step)
            gained = _gained(errors, tried)
            if not (fresh or gained > 0.0):
                break
            may_be_shorter = damping.learn(x, float(gradient @ step), promise, gained)
            if not gained > 0.0:
                if not may_be_shorter:
                    return Solution(x, errors, derivative, True, stuck=True)
                refused = True
                continue
            change, fresh = tried - errors, False
            x, errors = x + step, tried
            if not (smooth and RELIABLE * promise <= gained < FAR * square):
                break
            derivative, curvature = _carried_on(derivative, curvature, change, step)
            gradient = derivative.T @ errors
    return Solution(x, errors, None, False)


def _is_little(promise: float, square: float, errors: FloatArray) -> bool:
    """Tell whether a fall of the squared error is too small to count, of errors that are partly independent."""
    least = CONVERGED * square / errors.size
    if not least <= promise < MOST_AS_ONE * least:
        return promise < least
    return promise < CONVERGED * square / effective_samples([errors])


def _gained(errors: FloatArray, tried: FloatArray) -> float:
    """Return by how much the squared error falls; a simulation that ran away has an infinite one."""
    with np.errstate(over="ignore"):
        return float(errors @ errors) - float(tried @ tried)


def _carried_on(
    derivative: FloatArray, curvature: FloatArray, change: FloatArray, step: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the nearest derivative that has the change of the errors over a step (Broyden), and its curvature."""
    missed = (change - derivative @ step) / (step @ step)
    across = np.outer(derivative.T @ missed, step)
    bent: FloatArray = curvature + across + across.T + (missed @ missed) * np.outer(step, step)
    return (derivative.T + np.outer(step, missed)).T, bent


def damped_step(
    x: FloatArray,
    gradient: FloatArray,
    curvature: FloatArray,
    damping: float,
    low: FloatArray,
    high: FloatArray,
    scale: FloatArray | None = None,
) -> FloatArray:
    """Return the step (U,) that minimises the quadratic inside the bounds, damped by parts of a scale (U,).

    The scale is the curvature's diagonal by default, as Marquardt's.
    """
    free = unbounded_first(low, high, low < high)
    damped = curvature + np.diag(damping * (_floored(np.diag(curvature)) if scale is None else scale))
    down, up = low[free] - x[free], high[free] - x[free]
    step = np.zeros_like(x)
    step[free] = least_of_quadratic(
        damped[np.ix_(free, free)], gradient[free], np.minimum(down, 0.0), np.maximum(up, 0.0)
    )
    return step


def _floored(diagonal: FloatArray) -> FloatArray:
    """Return squared norms of columns, shape (U,), none of them next to nothing against the largest, nor 0."""
    return np.asarray(np.maximum(diagonal, 1e-12 * (diagonal.max() or 1.0)))
