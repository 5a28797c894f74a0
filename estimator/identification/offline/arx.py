"""Autoregressive model with external input (ARX): least squares on the equation error.

::

    A(q^-1) y(t) = B(q^-1) u(t) + w(t),     theta_hat = (sum phi phi^T)^-1 sum phi y
    phi(t) = [-y(t-1) .. -y(t-na), u(t-nk) .. u(t-nk-nb+1)]

It has one minimum, found in one step, and the best prediction one step ahead. But measured outputs stand among the
regressors: noise on y that is not exactly w / A biases theta (L. Ljung, System Identification, 2nd ed., section 7.3),
and on a lightly damped drive it is the damping that suffers. Shown for comparison; not for a model to simulate with.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from estimator.errors import NotExciting
from estimator.identification.linear_model import Orders
from estimator.identification.offline.covariance import sandwich
from estimator.identification.offline.fitting import problem_of
from estimator.identification.offline.linear_fit import LinearFit, Method, summary
from estimator.identification.offline.noise_model import NoiseModel, fit_noise, reach
from estimator.identification.offline.starts import arx, complete_rows, regressor
from estimator.signals.record import Record


def fit_arx(record: Record, orders: Orders | None = None) -> LinearFit:
    """Fit an ARX model to a recording's total torque and output.

    Parameters
    ----------
    record : Record
        With the slow part removed; not changed.
    orders : Orders, optional
        Structure; na = nb = 4, nk = 1 by default.

    Returns
    -------
    LinearFit
        Poles outside the unit circle are reflected into it, so that it can be simulated. The covariance tells of
        scatter alone, not of the bias.

    Raises
    ------
    NotExciting
        If the data do not determine a model of these orders, or the mask leaves no unbroken stretch for one.
    """
    problem, first = problem_of(record, orders)
    u, y, okay, orders = problem.u, problem.y, problem.okay, problem.orders
    model = arx(u, y, okay, orders, problem.sample_time_s)
    if model is None:
        raise NotExciting(
            f"recording {record.name}: the mask leaves too few stretches of {orders.n_states + 1} unbroken samples for "
            f"an ARX model; {', '.join(orders.names)} can't be determined. Take the output-error model, which needs "
            "no past outputs, or lower the orders.",
            orders.names,
        )
    rows = complete_rows(okay, orders)
    phi = regressor(u, np.where(okay, y, 0.0), orders)
    equation_error = np.where(rows, y - phi @ model.theta, 0.0)
    left = fit_noise(equation_error, rows, reach(problem.sample_time_s))
    x = problem.start(model)
    noise = NoiseModel(model.A, float(np.sqrt(np.mean(equation_error[rows] ** 2))))
    result = summary(
        Method.ARX, model, sandwich(phi, rows, left), problem.state(x), first, y, okay, problem.error(x), noise, block=1
    )
    return replace(result, n_samples=int(np.count_nonzero(rows)))
