"""Batch output-error model: the prediction-error method on the free-run simulation.

:mod:`estimator.identification.offline.problem` has the equations. Several starts; the best minimum wins. The estimate
is consistent whatever the colour of the noise on y as long as torque does not follow speed; its covariance takes the
colour into account. Where the noise is far from white, :func:`fit_box_jenkins` makes more of the same data.
"""

from __future__ import annotations

from estimator.identification.linear_model import Orders
from estimator.identification.offline.checks import require_identifiable
from estimator.identification.offline.covariance import sandwich
from estimator.identification.offline.linear_fit import LinearFit, Method, summary
from estimator.identification.offline.noise_model import fit_noise, reach
from estimator.identification.offline.problem import Problem
from estimator.identification.offline.starts import candidates
from estimator.signals.record import FloatArray, Record

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
    x = problem.solve(candidates(problem.u, problem.y, problem.okay, problem.orders, problem.sample_time_s))
    return output_error_summary(problem, x, first)


def problem_of(record: Record, orders: Orders | None) -> tuple[Problem, int]:
    """Return the least-squares problem of a recording from its first good sample on, and the number of that sample.

    Raises
    ------
    NotExciting
        If the data do not determine a model of these orders.
    """
    orders = Orders() if orders is None else orders
    u, y = record.total_torque_nm, record.output
    require_identifiable(record, orders)
    first = int(record.okay.argmax())
    return Problem(u[first:], y[first:], record.okay[first:], orders, record.sample_time_s), first


def output_error_summary(problem: Problem, x: FloatArray, first: int) -> LinearFit:
    """Put together what came out at x, with the covariance for a coloured residual."""
    n, error = problem.orders.n_parameters, problem.error(x)
    noise = fit_noise(error, problem.okay, reach(problem.sample_time_s))
    covariance = sandwich(problem.gradient(x), problem.okay, noise)[:n, :n]
    model, state = problem.model(x), x[n:]
    return summary(Method.OUTPUT_ERROR, model, covariance, state, first, problem.y, problem.okay, error, noise)
