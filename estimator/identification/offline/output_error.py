"""Batch output-error model: the prediction-error method on the free-run simulation.

:mod:`estimator.identification.offline.problem` has the equations. Several starts; the best minimum wins. The estimate
is consistent whatever the colour of the noise on y as long as torque does not follow speed; its covariance takes the
colour into account. Where the noise is far from white, :func:`fit_box_jenkins` makes more of the same data.
"""

from __future__ import annotations

from estimator.identification.linear_model import Orders
from estimator.identification.offline.covariance import sandwich
from estimator.identification.offline.fitting import problem_of, starts, summarised
from estimator.identification.offline.linear_fit import LinearFit, Method
from estimator.identification.offline.noise_model import fit_noise, reach
from estimator.signals.record import Record

__all__ = ["OutputErrorFit", "fit_output_error", "problem_of"]

OutputErrorFit = LinearFit
"""What :func:`fit_output_error` returns: the one type of every off-line estimator."""


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
    problem, first = problem_of(record, orders)
    x = problem.solve(starts(problem))
    noise = fit_noise(problem.blocks.mean(problem.error(x)), problem.blocks.okay, reach(problem.period_s))
    gradient = problem.blocks.mean(problem.gradient(x))
    covariance = sandwich(gradient, problem.blocks.okay, noise)
    n = problem.orders.n_parameters
    return summarised(Method.OUTPUT_ERROR, problem, x, first, covariance[:n, :n], noise)
