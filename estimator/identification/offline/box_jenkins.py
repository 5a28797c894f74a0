"""Box-Jenkins model with autoregressive noise: the driveline's response and the colour of all else, together.

::

    y(t) = B / A u(t) + 1 / D w(t),       w white

The sum of w(t)^2 over A, B and D together is least at the maximum-likelihood estimate (G. E. P. Box and G. M. Jenkins,
Time Series Analysis, chapter 11; L. Ljung, System Identification, 2nd ed., section 7.4). D is long, a second:
road, grade and the driver's slow changes are the noise's, and no pole of the driveline has to follow them. The
covariance is that of the joint estimate, so that what feedback correlates, plant and noise, widens the intervals.

On 200 buses on a road, with a driver, the errors of frequency and damping were 0.24 and 0.38 times those of the
output-error fit (``python -m tests.benchmarks.identification``); on quiet roads both are as good.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from estimator.identification.linear_model import Orders
from estimator.identification.offline.fitting import problem_of, starts, summarised
from estimator.identification.offline.linear_fit import LinearFit, Method
from estimator.identification.offline.noise_model import NoiseModel, fit_noise, reach
from estimator.identification.offline.problem import Problem
from estimator.signals.record import FloatArray, Record

MOST_STARTS = 2
"""Starts that are followed, those of the least innovations first: the next best is there for what the best misses."""


def fit_box_jenkins(record: Record, orders: Orders | None = None, memory: int | None = None) -> LinearFit:
    """Fit a Box-Jenkins model to a recording's total torque and output.

    Parameters
    ----------
    record : Record
        With the slow part removed; not changed. At the period at which the torque was held, and with the orders of the
        drive (three and three for two masses), the intervals cover the truth as often as they say.
    orders : Orders, optional
        Structure of B / A; na = nb = 4, nk = 1 by default.
    memory : int, optional
        Order of D in samples (of block means where the recording is faster); a second by default. Gaps in the
        mask shorten it.

    Returns
    -------
    LinearFit
        Its noise model is D.

    Raises
    ------
    NotExciting
        If the data do not determine a model of these orders.
    """
    return fit_of(*solved(record, orders, memory))


def fit_of(problem: Problem, x: FloatArray, first: int) -> LinearFit:
    """Return the fit at the minimum of :func:`solved`, with the covariance of the joint estimate."""
    covariance, noise = _spread(problem, x)
    free = problem.with_free_response(x)  # a free run is judged by itself
    return summarised(Method.BOX_JENKINS, problem, free, first, covariance, noise)


def solved(record: Record, orders: Orders | None, memory: int | None = None) -> tuple[Problem, FloatArray, int]:
    """Return the joint problem, its minimum, and the first sample it counts from; as :func:`fit_box_jenkins`."""
    plain, first = problem_of(record, orders)
    order = reach(plain.period_s) if memory is None else memory
    begin = sorted(((x, _noise_of(plain, x, order)) for x in starts(plain)), key=lambda each: each[1].std)[:MOST_STARTS]
    problem = replace(plain, noise_order=min(noise.order for _, noise in begin))
    x = problem.solve([np.concatenate([x, noise.D[1 : problem.noise_order + 1]]) for x, noise in begin])
    return problem, x, first


def _noise_of(problem: Problem, x: FloatArray, order: int) -> NoiseModel:
    return fit_noise(problem.blocks.mean(problem.error(x)), problem.blocks.okay, order)


def _spread(problem: Problem, x: FloatArray) -> tuple[FloatArray, NoiseModel]:
    """Return the covariance of theta, ``sigma^2 (J^T J)^-1`` of the joint estimate, and the noise model."""
    n, w = problem.orders.n_parameters, problem.residual(x)
    J = problem.jacobian(x, of_theta=True)
    scale = np.maximum(np.linalg.norm(J, axis=0), np.finfo(np.float64).tiny)
    inverse = np.linalg.pinv((J / scale).T @ (J / scale), hermitian=True) / np.outer(scale, scale)
    variance = float(w @ w) / max(w.shape[0] - problem.n_unknowns(x) - J.shape[1], 1)
    D = np.concatenate([[1.0], x[problem.n_plant :]])
    return variance * inverse[:n, :n], NoiseModel(D, float(np.sqrt(variance)))
