"""The least-squares problem of every output-error fit: free-run simulation error and its gradient.

::

    y(t) = B(q^-1) / A(q^-1) u(t) + C(q^-1) / A(q^-1) delta(t) + e(t),     minimise sum of e(t)^2

C is the free response to what was before the first sample; it is estimated with A and B. The gradient of the
prediction comes by filtering (L. Ljung, System Identification, 2nd ed., chapter 10)::

    d yhat / d a_i = -q^-i yhat / A
    d yhat / d b_j = q^-(nk+j-1) u / A
    d yhat / d c_j = q^-(j-1) delta / A

Gauss-Newton steps with Levenberg and Marquardt's damping. A step to an unstable A is refused, so the model is stable.
Masked outputs simply do not count: the prediction uses no measured output.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

from estimator.identification.linear_model import LinearModel, Orders, free_response
from estimator.identification.offline.starts import delayed
from estimator.identification.triangular import solve_least_squares
from estimator.signals.record import BoolArray, FloatArray

MOST_EVALUATIONS = 60
"""Evaluations per start. Gauss-Newton needs 10 to 30; more are spent in a valley with a flat floor."""

REFUSED = 1e100
"""Error of every sample at an unstable A: above any other, and finite, as the solver needs it."""


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """The least-squares problem in x = [a, b, c]; u, y and okay of shape (N,)."""

    u: FloatArray
    y: FloatArray
    okay: BoolArray
    orders: Orders
    sample_time_s: float

    def model(self, x: FloatArray) -> LinearModel:
        """Return the transfer function of x."""
        return LinearModel.from_theta(x[: self.orders.n_parameters], self.orders, self.sample_time_s)

    def error(self, x: FloatArray) -> FloatArray:
        """Return measured less simulated output at every sample, shape (N,); anything where masked."""
        return self.y - self.model(x).simulate(self.u, x[self.orders.n_parameters :])

    def residual(self, x: FloatArray) -> FloatArray:
        """Return simulated less measured of each good sample; beyond measure if A is unstable."""
        if not self.model(x).is_stable:
            return np.full(int(np.count_nonzero(self.okay)), REFUSED)
        return -self.error(x)[self.okay]

    def gradient(self, x: FloatArray) -> FloatArray:
        """Return d simulated / d x at every sample, shape (N, na + nb + n_states)."""
        model, orders = self.model(x), self.orders
        y_hat = model.simulate(self.u, x[orders.n_parameters :])
        y_f, u_f = lfilter([1.0], model.A, y_hat), lfilter([1.0], model.A, self.u)
        impulse_f = free_response(model.A, np.ones(1), self.u.shape[0])
        columns = [-delayed(y_f, i) for i in range(1, orders.na + 1)]
        columns += [delayed(u_f, orders.nk + j) for j in range(orders.nb)]
        columns += [delayed(impulse_f, j) for j in range(orders.n_states)]
        return np.column_stack(columns)

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Return d residual / d x, shape (good samples, na + nb + n_states)."""
        return np.asarray(self.gradient(x)[self.okay], dtype=np.float64)

    def start(self, model: LinearModel) -> FloatArray:
        """Return x of a model, with the free response that suits it best (C enters linearly)."""
        x = np.concatenate([model.theta, np.zeros(self.orders.n_states)])
        free = self.jacobian(x)[:, self.orders.n_parameters :]
        x[self.orders.n_parameters :] = solve_least_squares(free, -self.residual(x))
        return x

    def solve(self, starts: Iterable[LinearModel]) -> FloatArray:
        """Return the x of least cost over all starts."""
        solutions = [
            least_squares(
                self.residual,
                self.start(model),
                jac=self.jacobian,
                x_scale="jac",
                method="lm",
                max_nfev=MOST_EVALUATIONS,
            )
            for model in starts
        ]
        x: FloatArray = min(solutions, key=lambda solution: float(solution.cost)).x
        return x
