"""Instrumental variables, refined by iteration: no bias by noise, not even where torque follows speed.

Least squares asks that the equation error be uncorrelated with the regressor phi, which holds measured outputs and so
is correlated with it. Instruments zeta take phi's place on one side::

    theta_hat = (sum zeta phi_f^T)^-1 sum zeta y_f,      x_f = x / A_hat
    phi_f(t)  = [-y_f(t-1) .. -y_f(t-na), u_f(t-nk) ..]
    zeta(t)   = [-x_f(t-1) .. -x_f(t-na), r_f(t-nk) ..],   x = B_hat / A_hat r

and are made of nothing but r, which the noise does not reach: of the torque itself where it was set without regard to
the speed (P. C. Young's simplified refined instrumental variable, 1976), else of the part of the torque that an
outside signal explains, such as the PRBS (M. Gilson and P. Van den Hof, Automatica 41, 2005). A_hat, B_hat are those
of the last turn. With ``S = sum zeta phi_f^T`` and the residual's colour in Q, as for an output-error fit, the
covariance is ``S^-1 Q S^-T``.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from estimator.errors import BadShape, NotExciting
from estimator.identification.linear_model import LinearModel, Orders, free_response
from estimator.identification.offline.fitting import problem_of, summarised
from estimator.identification.offline.linear_fit import LinearFit, Method
from estimator.identification.offline.noise_model import fit_noise, reach
from estimator.identification.offline.problem import Problem, simulated, transient
from estimator.identification.offline.starts import HIGH_ORDER, arx, candidates, delayed, regressor, stabilised
from estimator.signals.record import BoolArray, FloatArray, Record

MOST_TURNS = 30

STILL = 1e-6
"""Relative change of theta below which it has come to rest."""


def fit_instrumental(record: Record, orders: Orders | None = None, instrument: FloatArray | None = None) -> LinearFit:
    """Fit B / A to a recording's total torque and output by refined instrumental variables.

    Parameters
    ----------
    record : Record
        With the slow part removed; not changed.
    orders : Orders, optional
        Structure; na = nb = 4, nk = 1 by default.
    instrument : ndarray, shape (N,), optional
        A signal that drives the torque and knows nothing of the speed, e.g. the PRBS, filtered as the record was. The
        torque itself by default, right in open loop only.

    Raises
    ------
    NotExciting
        If the data, or the instrument, do not determine a model of these orders.
    BadShape
        If the instrument does not have one finite value per sample.
    """
    problem, first = problem_of(record, orders)
    r = _driven_by(instrument, record, problem, first)
    model = next(candidates(problem.u, problem.y, problem.okay, problem.orders, problem.sample_time_s))
    for _ in range(MOST_TURNS):
        zeta, phi, target, rows = _turn(problem, model, r)
        S = zeta[rows].T @ phi[rows]
        if np.linalg.matrix_rank(S) < S.shape[0]:
            names = problem.orders.names
            raise NotExciting(
                f"recording {record.name}: the instrument does not drive the torque in {len(names)} independent ways; "
                f"{', '.join(names)} can't be determined. Give the PRBS that was superposed, in step with the torque.",
                names,
            )
        x: FloatArray = np.asarray(np.linalg.solve(S, zeta[rows].T @ target[rows]), dtype=np.float64)
        before, model = model.theta, stabilised(_linear(problem, x))
        if np.linalg.norm(model.theta - before) <= STILL * np.linalg.norm(before):
            break
    return _summary(problem, model, first, r)


def _driven_by(instrument: FloatArray | None, record: Record, problem: Problem, first: int) -> FloatArray:
    """Return the part of the torque that the instrument explains, from the first good sample on, shape (N - first,)."""
    if instrument is None:
        return problem.u
    if instrument.shape != record.output.shape or not np.isfinite(instrument).all():
        raise BadShape(
            f"recording {record.name}: the instrument has shape {instrument.shape}, expected {record.output.shape} and "
            "finite values: one per sample of the torque."
        )
    r = instrument[first:]
    loop = arx(r, problem.u, np.ones(r.shape, dtype=np.bool_), Orders(HIGH_ORDER, HIGH_ORDER, 0), problem.sample_time_s)
    return problem.u if loop is None else loop.simulate(r)


def _turn(problem: Problem, model: LinearModel, r: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Return instruments, regressor, target and the rows to use, with masked outputs filled by the simulation.

    The free response of the time before is a regressor, and its own instrument: nothing but A is in it.
    """
    A, state = model.A, problem.state(problem.start(model))
    filled = np.where(problem.okay, problem.y, simulated(model, problem.u, state))
    impulse_f = free_response(A, np.ones(1), r.shape[0])
    free = [delayed(impulse_f, j) for j in range(problem.orders.n_states)]
    free.append(transient(r.shape[0], problem.sample_time_s))
    x_f, r_f, y_f, u_f = (lfilter([1.0], A, x) for x in (model.simulate(r), r, filled, problem.u))
    zeta, phi = regressor(r_f, x_f, problem.orders), regressor(u_f, y_f, problem.orders)
    return np.column_stack([zeta, *free]), np.column_stack([phi, *free]), y_f, problem.okay


def _summary(problem: Problem, model: LinearModel, first: int, r: FloatArray) -> LinearFit:
    zeta, phi, target, rows = _turn(problem, model, r)
    n = problem.orders.n_parameters
    inverse = np.linalg.inv(zeta[rows].T @ phi[rows])
    left = fit_noise(target - phi @ (inverse @ (zeta[rows].T @ target[rows])), rows, reach(problem.sample_time_s))
    coloured = left.coloured_backwards(np.where(rows[:, np.newaxis], zeta, 0.0))
    n_rows, spent = int(np.count_nonzero(rows)), zeta.shape[1] + left.order
    scale = left.std**2 * n_rows / max(n_rows - spent, 1)
    covariance = (scale * inverse @ (coloured.T @ coloured) @ inverse.T)[:n, :n]
    x = problem.start(model)
    noise = fit_noise(problem.blocks.mean(problem.error(x)), problem.blocks.okay, reach(problem.period_s))
    return summarised(Method.INSTRUMENTAL_VARIABLE, problem, x, first, covariance, noise)


def _linear(problem: Problem, theta: FloatArray) -> LinearModel:
    return LinearModel.from_theta(theta[: problem.orders.n_parameters], problem.orders, problem.sample_time_s)
