"""The least-squares problem of every output-error and Box-Jenkins fit: simulation error, its noise, its gradient.

::

    y(t) = B(q^-1) / A(q^-1) u(t) + C(q^-1) / A(q^-1) delta(t) + h rho^t + e(t),     D(q^-1) e(t) = w(t)
    minimise the sum of w(t)^2 over A, B, C, h and D
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.signal import lfilter
from threadpoolctl import threadpool_limits

from estimator.identification.linear_model import (
    ComplexArray,
    LinearModel,
    Orders,
    free_response,
    products_of_past,
    solve_least_squares,
)
from estimator.identification.offline.missing import RIDGE, Elimination, OutputResponses, UnreadTorque
from estimator.identification.offline.starts import delayed
from estimator.least_squares import TrustRegion, minimise
from estimator.signals.decimate import HIGH_PASS_HZ, Blocks
from estimator.signals.record import BoolArray, FloatArray

INSIDE = 1.0 - 1e-6
"""Stands for 1 in both: rounding then leaves every pole inside, the slowest with a time constant of 10^6 samples."""

MOST_DERIVATIVES = 45
"""Jacobians per start. Gauss-Newton needs 10 to 30; more are spent in a valley with a flat floor."""

MOST_STARTS = 3
"""Starts that are followed, those of least cost first: the next best is there for what the best misses."""

WHOLE, BEGINNING = 30_000, 6_000
"""Blocks of a recording up to which starts are followed over the whole; of a longer one first over its beginning."""

SETTLED = 1e-7
"""Relative change of the sum of squares that ends a fit: of 10 000 samples, a thousandth of one parameter's share."""


def parameters_of(a: FloatArray) -> FloatArray:
    """Return x, shape (na,), of coefficients ``a_1 .. a_na``; poles on or outside the circle are moved inside."""
    poles = np.roots(np.concatenate([[1.0], a]))
    radius = np.abs(poles)
    poles = np.where(radius < 1.0, poles, poles / np.maximum(radius, 1.0) ** 2)
    pairs = poles[poles.imag > 0.0]
    real = np.sort(poles[poles.imag == 0.0].real)
    two = [(-2.0 * z.real, abs(z) ** 2) for z in pairs.tolist()]
    two += [(-(p + q), p * q) for p, q in zip(real[:-1:2].tolist(), real[1::2].tolist(), strict=True)]
    tangents = [t for a_1, a_2 in two for t in (a_1 / max(1.0 + a_2, 1.0 - INSIDE), a_2)]
    tangents += [-float(real[-1])] if real.size % 2 else []
    tangents += [0.0] * (a.shape[0] - len(tangents))  # leading coefficients that vanished have roots at 0
    return np.arctanh(np.clip(np.array(tangents) / INSIDE, -INSIDE, INSIDE))


def denominator_of(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return ``a_1 .. a_na`` of x, shape (na,), and their derivatives ``d a_i / d x_j``, shape (na, na)."""
    tangents = INSIDE * np.tanh(x)
    steepness = INSIDE - tangents**2 / INSIDE
    sections, slopes = [], []
    for i in range(0, x.shape[0] - 1, 2):
        t_1, t_2 = tangents[i : i + 2]
        sections.append(np.array([1.0, t_1 * (1.0 + t_2), t_2]))
        slopes.append(np.array([0.0, steepness[i] * (1.0 + t_2), 0.0]))
        slopes.append(steepness[i + 1] * np.array([0.0, t_1, 1.0]))
    if x.shape[0] % 2:
        sections.append(np.array([1.0, tangents[-1]]))
        slopes.append(np.array([0.0, steepness[-1]]))
    columns = [np.convolve(_product(sections, without=j // 2), slope)[1:] for j, slope in enumerate(slopes)]
    return _product(sections)[1:], np.array(columns).reshape(x.shape[0], x.shape[0]).T


def _product(sections: list[FloatArray], without: int = -1) -> FloatArray:
    product = np.ones(1)
    for i, section in enumerate(sections):
        if i != without:
            product = np.convolve(product, section)
    return product


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

    x: FloatArray  # the unknowns
    u: FloatArray  # (N,), input, with what was not read estimated
    y_hat: FloatArray  # (N,), free run
    e: FloatArray  # (N,), measured minus free run
    w: FloatArray  # innovations: e through D
    elimination: Elimination  # how what was not read follows from x


@dataclass(frozen=True, eq=False)
class Problem:
    """The least-squares problem in ``x = [A's parameters, b, c, h, d]``; u, y, okay and read of shape (N,)."""

    u: FloatArray  # input, output, and whether the output was measured
    y: FloatArray  # measured output
    okay: BoolArray  # whether it was measured
    orders: Orders  # of B / A
    sample_time_s: float  # sampling period [s]
    read: BoolArray | None = None  # whether the input was read
    noise_order: int = 0  # of D; 0 for an output-error fit
    block: int = 1  # samples whose mean error is one sample to D
    _last: list[_Point] = field(default_factory=list, init=False, repr=False)  # the latest point that was asked for

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
        return np.column_stack([self._plant_slopes(x, of_theta=of_theta), self._past(x)])

    def _plant_slopes(self, x: FloatArray, *, of_theta: bool = False) -> FloatArray:
        """Return d w / d [A's parameters, b, c, h], shape (n, n_plant)."""
        plant = -self.gradient(x)
        if not of_theta:
            _, slopes = denominator_of(x[: self.orders.na])
            plant[:, : self.orders.na] = plant[:, : self.orders.na] @ slopes
        return self.whitened(x, plant)

    def _past(self, x: FloatArray) -> FloatArray:
        """Return d w / d D, shape (n, noise_order)."""
        at, p = self._at(x), self.noise_order
        return at.elimination.without(np.lib.stride_tricks.sliding_window_view(at.e[:-1], p)[:, ::-1])

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
        return self.with_free_response(x)

    def start_at(self, poles: ComplexArray) -> FloatArray:
        """Return x with these poles, shape (na,), and the B and C that suit them best: both enter linearly."""
        x = np.zeros(self.n_plant + self.noise_order)
        x[: self.orders.na] = parameters_of(np.real(np.poly(poles))[1:])
        return self._with_linear_part(x, self.orders.na)

    def with_free_response(self, x: FloatArray) -> FloatArray:
        """Return x with the free response of least simulation error, whatever the noise."""
        return self._with_linear_part(x.copy(), self.orders.n_parameters)

    def _with_linear_part(self, x: FloatArray, first: int) -> FloatArray:
        columns, okay = self.blocks.mean(self.gradient(x)[:, first:]), self.blocks.okay
        x[first : self.n_plant] += solve_least_squares(columns[okay], self.blocks.mean(self.error(x))[okay])
        return x

    def solve(self, starts: Iterable[LinearModel | FloatArray]) -> FloatArray:
        """Return the x of least cost over the best starts, each a model or an x.

        Of a long recording each is followed over its beginning first: from there it is near.
        """
        with threadpool_limits(1):  # problems this small wait for other threads longer than they compute
            begin = [self.start(start) if isinstance(start, LinearModel) else start for start in starts]
            begin = sorted(begin, key=self._cost)[:MOST_STARTS]
            if self.blocks.okay.size > WHOLE:
                beginning = self._beginning()
                begin = [min(x, beginning.solve([x]), key=self._cost) for x in begin]
            if self.noise_order:
                begin = [min((self._with_noise_projected(x) for x in begin), key=self._cost)]
            return min((descended(self.residual, self.jacobian, x) for x in begin), key=self._cost)

    def _beginning(self) -> Problem:
        """Return the problem of the first samples alone, with the same unknowns."""
        first = slice(BEGINNING * self.block)
        read = None if self.read is None else self.read[first]
        return replace(self, u=self.u[first], y=self.y[first], okay=self.okay[first], read=read)

    def _cost(self, x: FloatArray) -> float:
        w = self.residual(x)
        return float(w @ w)

    def _with_noise_projected(self, start: FloatArray) -> FloatArray:
        """Return the minimum over A, B, C and h, each with the D that suits it best: exact where no output is missing.

        D enters w linearly: variable projection (G. Golub and V. Pereyra, SIAM J. Numerical Analysis 10, 1973) with
        the slopes of L. Kaufman (BIT 15, 1975). A hundred unknowns fewer than the joint problem, the same minimum.
        """
        n, known = self.n_plant, _Projected(np.zeros(0), start, np.zeros((0, 0)), np.zeros((0, 0)))

        def at(plant: FloatArray) -> _Projected:
            nonlocal known
            if not np.array_equal(known.plant, plant):
                x = np.concatenate([plant, start[n:]])
                E = self._past(x)
                measured = self._at(x).elimination.n_unknowns == 0
                normal = products_of_past(self._at(x).e, self.noise_order) if measured else E.T @ E
                normal[np.diag_indices_from(normal)] += RIDGE * normal.max() + np.finfo(np.float64).tiny
                inverse = np.asarray(np.linalg.inv(normal), dtype=np.float64)
                x[n:] -= inverse @ (E.T @ self.residual(x))
                known = _Projected(plant.copy(), x, E, inverse)
            return known

        def slopes(plant: FloatArray) -> FloatArray:
            found = at(plant)
            J = self._plant_slopes(found.x)
            return np.asarray(J - found.E @ (found.inverse @ (found.E.T @ J)), dtype=np.float64)

        return at(descended(lambda plant: self.residual(at(plant).x), slopes, start[:n])).x


@dataclass(frozen=True, slots=True, eq=False)
class _Projected:
    """The best D for A, B, C and h, and what projects w onto what no D explains."""

    plant: FloatArray  # A, B, C and h
    x: FloatArray  # the same with the best D
    E: FloatArray  # d w / d D
    inverse: FloatArray  # of E^T E


def descended(
    residual: Callable[[FloatArray], FloatArray],
    jacobian: Callable[[FloatArray], FloatArray],
    start: FloatArray,
    derivatives: int = MOST_DERIVATIVES,
) -> FloatArray:
    """Return the minimum of the sum of squares that is reached from a start, shape (U,), by so many Jacobians at most.

    A derivative costs little more than a simulation here: each step has its own.
    """
    free, region = np.full(start.shape, np.inf), TrustRegion()
    return minimise(residual, jacobian, start, -free, free, derivatives, False, SETTLED, region).x
