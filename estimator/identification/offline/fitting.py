"""From a recording to the least-squares problem of an off-line fit, its starts, and the summary of what came out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from estimator.identification.linear_model import ComplexArray, Orders
from estimator.identification.offline.blocks import block_of
from estimator.identification.offline.checks import require_identifiable
from estimator.identification.offline.linear_fit import LinearFit, Method, summary
from estimator.identification.offline.noise_model import NoiseModel
from estimator.identification.offline.problem import Problem
from estimator.identification.offline.starts import candidates
from estimator.identification.offline.subspace import subspace
from estimator.signals.record import FloatArray, Record


def problem_of(record: Record, orders: Orders | None) -> tuple[Problem, int]:
    """Return the output-error problem of a recording from its first good sample on, and the number of that sample.

    Raises
    ------
    NotExciting
        If the data do not determine a model of these orders.
    """
    orders = Orders() if orders is None else orders
    require_identifiable(record, orders)
    first = int(record.okay.argmax())
    problem = Problem(
        u=record.total_torque_nm[first:],
        y=record.output[first:],
        okay=record.okay[first:],
        orders=orders,
        sample_time_s=record.sample_time_s,
        read=None if record.read is None else record.read[first:],
        block=block_of(record.sample_time_s),
    )
    return problem, first


def starts(problem: Problem) -> Iterator[FloatArray]:
    """Yield an x for each start; always at least one.

    They are found from block means, which the driveline fills with its motion whatever the recording's period is, and
    taken back to it by their poles.
    """
    k, orders = problem.block, problem.orders
    period_s = k * problem.sample_time_s
    u, y, okay = problem.blocks.mean(problem.u), problem.blocks.mean(problem.y), problem.blocks.okay
    if k > 1:
        everywhere = replace(problem, okay=np.ones_like(problem.okay))
        u = everywhere.blocks.mean(problem.u)
    first = subspace(u, y, okay, orders, period_s)
    models = [] if first is None else [first]
    for model in (*models, *candidates(u, y, okay, orders, period_s)):
        yield problem.start(model) if k == 1 else problem.start_at(_faster(model.poles, k))


def _faster(poles: ComplexArray, k: int) -> ComplexArray:
    """Return poles at a period k times as short; a negative one, which has no such root, keeps its radius."""
    real = np.where(poles.imag == 0.0, np.abs(poles.real), poles)
    return np.asarray(real ** (1.0 / k), dtype=np.complex128)


def summarised(
    method: Method, problem: Problem, x: FloatArray, first: int, covariance: FloatArray, noise: NoiseModel
) -> LinearFit:
    """Put together what came out at x; ``covariance`` of theta, shape (na+nb, na+nb)."""
    return summary(
        method,
        problem.model(x),
        covariance,
        problem.state(x),
        first,
        problem.y,
        problem.okay,
        problem.error(x),
        noise,
        problem.block,
    )
