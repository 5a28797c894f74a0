"""Batch output-error model: the prediction-error method on the free-run simulation.

::

    y(t) = B(q^-1) / A(q^-1) u(t) + C(q^-1) / A(q^-1) delta(t) + e(t),     minimise sum of e(t)^2

C is the free response to what was before the first sample; it is estimated with A and B. The gradient of the
prediction comes by filtering (L. Ljung, System Identification, 2nd ed., chapter 10)::

    d yhat / d a_i = -q^-i yhat / A
    d yhat / d b_j = q^-(nk+j-1) u / A
    d yhat / d c_j = q^-(j-1) delta / A

Gauss-Newton steps with Levenberg and Marquardt's damping. A step to an unstable A is refused, so the model is
stable. Several starts; the best minimum wins. Masked
outputs simply do not count: the prediction uses no measured output.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

from estimator.identification.excitation import require_excitation
from estimator.identification.linear_model import LinearModel, Orders, free_response
from estimator.identification.offline.starts import candidates, delayed
from estimator.identification.triangular import solve_least_squares
from estimator.signals.record import BoolArray, FloatArray, Record

MOST_EVALUATIONS = 60
"""Evaluations per start. Gauss-Newton needs 10 to 30; more are spent in a valley with a flat floor."""

REFUSED = 1e100
"""Error of every sample at an unstable A: above any other, and finite, as the solver needs it."""


@dataclass(frozen=True, slots=True, eq=False)
class OutputErrorFit:
    """A fitted model and how well it does.

    Attributes
    ----------
    model : LinearModel
        Stable transfer function.
    covariance : ndarray, shape (na+nb, na+nb)
        Covariance of theta, ``sigma^2 (J^T J)^-1``; right as far as the residual is white.
    state : ndarray, shape (n_states,)
        C, the free response's numerator, from sample ``first`` of the data.
    first : int
        First good sample; the simulation starts there.
    rms : float
        RMS of the free-run simulation error [output unit].
    fit_percent : float
        ``100 (1 - |y - yhat| / |y - mean y|)``, the normalised RMS fit (not R squared).
    n_samples : int
        Good samples used.
    """

    model: LinearModel
    covariance: FloatArray
    state: FloatArray
    first: int
    rms: float
    fit_percent: float
    n_samples: int

    def simulate(self, u: FloatArray) -> FloatArray:
        """Free-run simulation over the data's inputs, shape (N,); the time before ``first`` is 0."""
        out = np.zeros(u.shape[0])
        out[self.first :] = self.model.simulate(u[self.first :], self.state)
        return out


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """The least-squares problem in x = [a, b, c]."""

    u: FloatArray
    y: FloatArray
    okay: BoolArray
    orders: Orders
    sample_time_s: float

    def model(self, x: FloatArray) -> LinearModel:
        return LinearModel.from_theta(x[: self.orders.n_parameters], self.orders, self.sample_time_s)

    def residual(self, x: FloatArray) -> FloatArray:
        """Return the error of each good sample; so large that it is backed away from, if A is unstable."""
        model = self.model(x)
        if not model.is_stable:
            return np.full(int(np.count_nonzero(self.okay)), REFUSED)
        return (model.simulate(self.u, x[self.orders.n_parameters :]) - self.y)[self.okay]

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Return d residual / d x, shape (good samples, na + nb + n_states)."""
        model, orders = self.model(x), self.orders
        y_hat = model.simulate(self.u, x[orders.n_parameters :])
        y_f, u_f = lfilter([1.0], model.A, y_hat), lfilter([1.0], model.A, self.u)
        impulse_f = free_response(model.A, np.ones(1), self.u.shape[0])
        columns = [-delayed(y_f, i) for i in range(1, orders.na + 1)]
        columns += [delayed(u_f, orders.nk + j) for j in range(orders.nb)]
        columns += [delayed(impulse_f, j) for j in range(orders.n_states)]
        return np.column_stack(columns)[self.okay]

    def start(self, model: LinearModel) -> FloatArray:
        """Return x of a model, with the free response that suits it best (C enters linearly)."""
        x = np.concatenate([model.theta, np.zeros(self.orders.n_states)])
        free = self.jacobian(x)[:, self.orders.n_parameters :]
        x[self.orders.n_parameters :] = solve_least_squares(free, -self.residual(x))
        return x


def fit_output_error(record: Record, orders: Orders | None = None) -> OutputErrorFit:
    """Fit an output-error model to a recording's total torque and output.

    Parameters
    ----------
    record : Record
        With the slow part removed; not changed.
    orders : Orders, optional
        Structure; the paper's na = nb = 4, nk = 1 by default.

    Returns
    -------
    OutputErrorFit
        The best of several starts.

    Raises
    ------
    NotExciting
        If the data do not determine a model of these orders.
    """
    orders = Orders() if orders is None else orders
    u, y = record.total_torque_nm, record.output
    require_excitation(record.name, u, y, record.okay, orders)
    first = int(np.argmax(record.okay))
    problem = _Problem(u[first:], y[first:], record.okay[first:], orders, record.sample_time_s)
    best = _best(problem)
    return _summary(problem, best, first)


def _best(problem: _Problem) -> FloatArray:
    """Return the x of least cost over all starts."""
    solve = partial(least_squares, problem.residual, jac=problem.jacobian, x_scale="jac", method="lm")
    starts = candidates(problem.u, problem.y, problem.okay, problem.orders, problem.sample_time_s)
    solutions = [solve(problem.start(model), max_nfev=MOST_EVALUATIONS) for model in starts]
    x: FloatArray = min(solutions, key=lambda solution: float(solution.cost)).x
    return x


def _summary(problem: _Problem, x: FloatArray, first: int) -> OutputErrorFit:
    n = problem.orders.n_parameters
    residual, jacobian = problem.residual(x), problem.jacobian(x)
    measured = problem.y[problem.okay]
    freedom = max(residual.shape[0] - x.shape[0], 1)
    information = jacobian.T @ jacobian
    covariance = np.linalg.pinv(information, hermitian=True) * float(residual @ residual) / freedom
    spread = float(np.linalg.norm(measured - measured.mean()))
    return OutputErrorFit(
        model=problem.model(x),
        covariance=covariance[:n, :n],
        state=x[n:],
        first=first,
        rms=float(np.sqrt(np.mean(residual**2))),
        fit_percent=100.0 * (1.0 - float(np.linalg.norm(residual)) / spread),
        n_samples=residual.shape[0],
    )
