"""Box-Jenkins model with autoregressive noise: the output-error model and the colour of what it leaves, in turn.

::

    y(t) = B / A u(t) + 1 / D w(t),       w white

Given D, filtering u and y by it makes the noise white and the output-error fit of the filtered data the
maximum-likelihood estimate of B / A; given B / A, D is the autoregression of the residual. The two are repeated until
neither moves (generalised least squares: D. W. Clarke 1967; P. C. Young, Recursive Estimation and Time-Series
Analysis, chapter 7, the refined form). B / A and D have nothing in common, so the covariance of B / A is that of the
last filtered fit.

On 60 simulated cruises of 22 s the resonance scattered 0.6 times and its damping a third as much as those of the
output-error fit: noise that is strong below 1 Hz no longer drowns what the band around the resonance says.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from estimator.identification.linear_model import Orders
from estimator.identification.offline.covariance import sandwich
from estimator.identification.offline.linear_fit import LinearFit, Method, summary
from estimator.identification.offline.noise_model import NoiseModel, fit_noise, reach
from estimator.identification.offline.output_error import problem_of
from estimator.identification.offline.problem import Problem
from estimator.identification.offline.starts import candidates
from estimator.signals.record import FloatArray, Record

MOST_TURNS = 8

STILL = 1e-3
"""Change of theta between two turns, in standard deviations, below which it has come to rest."""


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
        Order of D in samples; half a second by default. Gaps in the mask shorten it.

    Returns
    -------
    LinearFit
        Its noise model is D.

    Raises
    ------
    NotExciting
        If the data do not determine a model of these orders.
    """
    problem, first = problem_of(record, orders)
    order = reach(problem.sample_time_s) if memory is None else memory
    x = problem.solve(candidates(problem.u, problem.y, problem.okay, problem.orders, problem.sample_time_s))
    theta = problem.model(x).theta
    for _ in range(MOST_TURNS):
        noise = fit_noise(problem.error(x), problem.okay, order)
        whitened = whitened_by(problem, noise)
        x_w = whitened.solve([problem.model(x)])
        spread = sandwich(whitened.gradient(x_w), whitened.okay, _remainder(whitened, x_w, noise))
        x = problem.start(whitened.model(x_w))
        moved, theta = whitened.model(x_w).theta - theta, whitened.model(x_w).theta
        n = theta.shape[0]
        if (np.abs(moved) <= STILL * np.sqrt(np.diag(spread)[:n])).all():
            break
    return _summary(problem, x, first, spread[:n, :n], order)


def whitened_by(problem: Problem, noise: NoiseModel) -> Problem:
    """Return the problem with u and y filtered by D, from the first sample whose past is complete."""
    complete = noise.complete(problem.okay)
    y = noise.whiten(np.where(problem.okay, problem.y, 0.0))
    u = noise.whiten(problem.u)
    begin = int(complete.argmax())
    return replace(problem, u=u[begin:], y=y[begin:], okay=complete[begin:])


def _remainder(whitened: Problem, x: FloatArray, noise: NoiseModel) -> NoiseModel:
    """Return the noise of a whitened problem: white, but the coefficients of D are spent all the same."""
    rest = whitened.error(x)[whitened.okay]
    spent = 1.0 - noise.order / max(rest.shape[0], noise.order + 1)
    return NoiseModel(np.ones(1), float(np.sqrt(np.mean(rest**2) / spent)))


def _summary(problem: Problem, x: FloatArray, first: int, covariance: FloatArray, order: int) -> LinearFit:
    n, error = problem.orders.n_parameters, problem.error(x)
    noise = fit_noise(error, problem.okay, order)
    return summary(
        Method.BOX_JENKINS, problem.model(x), covariance, x[n:], first, problem.y, problem.okay, error, noise
    )
