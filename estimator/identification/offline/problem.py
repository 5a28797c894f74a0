"""The least-squares problem of every output-error and Box-Jenkins fit: simulation error, its noise, its gradient.

::

    y(t) = B(q^-1) / A(q^-1) u(t) + C(q^-1) / A(q^-1) delta(t) + h rho^t + e(t),     D(q^-1) e(t) = w(t)
    minimise the sum of w(t)^2 over A, B, C, h and D

C is the free response to what was before the first sample, h that of the high-pass both signals have passed, whose
pole is rho: a constant load that the driveline did not know at rest becomes this transient. D = 1 makes it the
output-error problem; with D free, w white is maximum likelihood. The gradient comes by filtering (L. Ljung, System
Identification, 2nd ed., chapter 10)::

    d yhat / d a_i = -q^-i yhat / A
    d yhat / d b_j = q^-(nk+j-1) u / A
    d yhat / d c_j = q^-(j-1) delta / A
    d w    / d d_i = q^-i e

A is stable by parametrisation (:mod:`estimator.identification.offline.stable`), so Levenberg and Marquardt's steps
need no bounds. What was not measured or not read is unknown rather than left out
(:mod:`estimator.identification.offline.missing`).

Samples that come faster than a driveline answers are simulated as they come, and their error is averaged over blocks
before D: an average of both sides of an equation holds exactly, and D stays short.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter
from threadpoolctl import threadpool_limits

from estimator.identification.linear_model import ComplexArray, LinearModel, Orders, free_response
from estimator.identification.offline.blocks import Blocks
from estimator.identification.offline.missing import Elimination, OutputResponses, UnreadTorque
from estimator.identification.offline.stable import denominator_of, parameters_of
from estimator.identification.offline.starts import delayed
from estimator.identification.triangular import solve_least_squares
from estimator.signals.decimate import HIGH_PASS_HZ
from estimator.signals.record import BoolArray, FloatArray

MOST_EVALUATIONS = 60
"""Evaluations per start. Gauss-Newton needs 10 to 30; more are spent in a valley with a flat floor."""

SETTLED = 1e-7
"""Relative change of the sum of squares that ends a fit: of 10 000 samples, a thousandth of one parameter's share."""


def transient(n_samples: int, sample_time_s: float) -> FloatArray:
    """Return ``rho^t``, the free response of the high-pass, shape (n_samples,)."""
    return np.asarray(np.exp(-2.0 * np.pi * HIGH_PASS_HZ * sample_time_s * np.arange(n_samples)), dtype=np.float64)


def simulated(model: LinearModel, u: FloatArray, state: FloatArray) -> FloatArray:
    """Return the output from the input alone and the state ``[c, h]`` before it, shape (N,)."""
    free = float(state[-1]) * transient(u.shape[0], model.sample_time_s)
    return np.asarray(model.simulate(u, state[:-1]) + free, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class _Point:
    """What is known at one x: signals with what is missing at its best values, and what eliminates it."""

    x: FloatArray
    u: FloatArray
    y_hat: FloatArray
    e: FloatArray
    w: FloatArray
    elimination: Elimination


@dataclass(frozen=True, eq=False)
class Problem:
    """The least-squares problem in ``x = [A's parameters, b, c, h, d]``; u, y, okay and read of shape (N,).

    Attributes
    ----------
    u, y, okay
        Input, output, and whether the output was measured.
    orders : Orders
        Of B / A.
    sample_time_s : float
        Sampling period [s].
    read : ndarray of bool, optional
        Whether the input was read; everywhere by default.
    noise_order : int
        Of D; 0 for an output-error fit.
    block : int
        Samples whose mean error is one sample to D.
    """

    u: FloatArray
    y: FloatArray
    okay: BoolArray
    orders: Orders
    sample_time_s: float
    read: BoolArray | None = None
    noise_order: int = 0
    block: int = 1
    _last: list[_Point] = field(default_factory=list, init=False, repr=False)

    @property
    def period_s(self) -> float:
        """Period of D [s]."""
        return self.block * self.sample_time_s

    @property
    def n_plant(self) -> int:
        """Unknowns that are not D's: na + nb + n_states + 1."""
        return self.orders.n_parameters + self.orders.n_states + 1

    @cached_property
    def blocks(self) -> Blocks:
        """Means of samples, where their error is judged."""
        return Blocks(self.okay, self.block)

    @cached_property
    def _unmeasured(self) -> OutputResponses:
        return OutputResponses(self.blocks.okay, self.noise_order)

    @cached_property
    def _unread(self) -> UnreadTorque:
        return UnreadTorque(self.read, self.orders.n_states)

    def theta(self, x: FloatArray) -> FloatArray:
        """Return ``[a, b]`` of x, shape (na+nb,)."""
        a, _ = denominator_of(x[: self.orders.na])
        return np.concatenate([a, x[self.orders.na : self.orders.n_parameters]])

    def model(self, x: FloatArray) -> LinearModel:
        """Return the transfer function of x."""
        return LinearModel.from_theta(self.theta(x), self.orders, self.sample_time_s)

    def state(self, x: FloatArray) -> FloatArray:
        """Return ``[c, h]`` of x, shape (n_states + 1,)."""
        return x[self.orders.n_parameters : self.n_plant]

    def noise(self, x: FloatArray) -> FloatArray:
        """Return D of x, shape (noise_order + 1,), leading 1."""
        return np.concatenate([[1.0], x[self.n_plant :]])

    def error(self, x: FloatArray) -> FloatArray:
        """Return measured less simulated output at every sample, shape (N,); anything where masked."""
        return self.y - simulated(self.model(x), self.u, self.state(x))

    def residual(self, x: FloatArray) -> FloatArray:
        """Return w of every block with all of its past, less what missing samples explain, shape (n,)."""
        return self._at(x).w

    def n_unknowns(self, x: FloatArray) -> int:
        """Return how many missing samples are eliminated at x."""
        return self._at(x).elimination.n_unknowns

    def gradient(self, x: FloatArray) -> FloatArray:
        """Return d simulated / d [a, b, c, h] at every sample, shape (N, n_plant)."""
        model, orders, at = self.model(x), self.orders, self._at(x)
        y_f, u_f = lfilter([1.0], model.A, at.y_hat), lfilter([1.0], model.A, at.u)
        impulse_f = free_response(model.A, np.ones(1), self.u.shape[0])
        columns = [-delayed(y_f, i) for i in range(1, orders.na + 1)]
        columns += [delayed(u_f, orders.nk + j) for j in range(orders.nb)]
        columns += [delayed(impulse_f, j) for j in range(orders.n_states)]
        return np.column_stack([*columns, transient(self.u.shape[0], self.sample_time_s)])

    def jacobian(self, x: FloatArray, *, of_theta: bool = False) -> FloatArray:
        """Return d w / d x, shape (n, n_plant + noise_order); by a and not A's parameters ``of_theta``."""
        plant, at = -self.gradient(x), self._at(x)
        if not of_theta:
            _, slopes = denominator_of(x[: self.orders.na])
            plant[:, : self.orders.na] = plant[:, : self.orders.na] @ slopes
        past = [delayed(at.e, i)[self.noise_order :] for i in range(1, self.noise_order + 1)]
        return at.elimination.without(np.column_stack([self._whitened(x, self.blocks.mean(plant)), *past]))

    def whitened(self, x: FloatArray, samples: FloatArray) -> FloatArray:
        """Return D of the block means of signals, less what missing samples explain, shape (N, m) to (n, m)."""
        return self._at(x).elimination.without(self._whitened(x, self.blocks.mean(samples)))

    def _at(self, x: FloatArray) -> _Point:
        """Return what is known at x; kept until another is asked for, since the solver asks twice."""
        if not (self._last and np.array_equal(self._last[0].x, x)):
            self._last[:] = [self._evaluated(x.copy())]
        return self._last[0]

    def _evaluated(self, x: FloatArray) -> _Point:
        model = self.model(x)
        y_hat = model.simulate(self.u, self.state(x)[:-1])
        e = self.blocks.mean(self.y - y_hat - self.state(x)[-1] * transient(self.u.shape[0], self.sample_time_s))
        responses = self._unread.responses(model, self.u.shape[0])
        inputs = None if responses is None else -self._whitened(x, self.blocks.mean(responses))
        elimination = Elimination(self._unmeasured.of(self.noise(x)), inputs)
        w = self._whitened(x, e)
        outputs, torque = elimination.values(w)
        u = self.u
        if responses is not None:
            u, y_hat = self._unread.added_to(u, torque), y_hat + responses @ torque
            e = e - self.blocks.mean(responses) @ torque
        e[~self.blocks.okay] = outputs
        return _Point(x, u, y_hat, e, elimination.without(w), elimination)

    def _whitened(self, x: FloatArray, means: FloatArray) -> FloatArray:
        """Return D of block means, shape (N,) or (N, m), from the first row with all of its past."""
        return np.asarray(lfilter(self.noise(x), [1.0], means, axis=0)[self.noise_order :], dtype=np.float64)

    def start(self, model: LinearModel) -> FloatArray:
        """Return x of a model, with the free response that suits it best (it enters linearly) and D = 1."""
        x = np.zeros(self.n_plant + self.noise_order)
        x[: self.orders.na] = parameters_of(np.array(model.a))
        x[self.orders.na : self.orders.n_parameters] = model.b
        return self._with_linear_part(x, self.orders.n_parameters)

    def start_at(self, poles: ComplexArray) -> FloatArray:
        """Return x with these poles, shape (na,), and the B and C that suit them best: both enter linearly."""
        x = np.zeros(self.n_plant + self.noise_order)
        x[: self.orders.na] = parameters_of(np.real(np.poly(poles))[1:])
        return self._with_linear_part(x, self.orders.na)

    def _with_linear_part(self, x: FloatArray, first: int) -> FloatArray:
        columns, okay = self.blocks.mean(self.gradient(x)[:, first:]), self.blocks.okay
        x[first : self.n_plant] += solve_least_squares(columns[okay], self.blocks.mean(self.error(x))[okay])
        return x

    def solve(self, starts: Iterable[LinearModel | FloatArray]) -> FloatArray:
        """Return the x of least cost over all starts, each a model or an x."""
        with threadpool_limits(1):  # problems this small wait for other threads longer than they compute
            solutions = [
                least_squares(
                    self.residual,
                    self.start(start) if isinstance(start, LinearModel) else start,
                    jac=self.jacobian,
                    x_scale="jac",
                    method="lm",
                    ftol=SETTLED,
                    max_nfev=MOST_EVALUATIONS,
                )
                for start in starts
            ]
        x: FloatArray = min(solutions, key=lambda solution: float(solution.cost)).x
        return x
