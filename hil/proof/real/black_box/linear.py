"""A linear model of the paper's order: output error, nA = nB = 4.

::

    y(t) = B(q^-1) / A(q^-1) (u(t) + c) + C(q^-1) / A(q^-1) delta(t) + e(t)

A and B are shared by all stretches; c and C are each stretch's own. For given A they enter linearly and are solved for,
so that only A and B are searched (variable projection: G. Golub, V. Pereyra, SIAM J. Numerical Analysis 10, 1973). A
step to an unstable A is refused. Starts are those of `estimator.identification`, from the longest stretches; of a
position, which integrates, also those of its rate with an integrator behind.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from scipy.optimize import least_squares

from estimator.identification.linear_model import LinearModel, Orders, free_response
from estimator.identification.offline.problem import MOST_EVALUATIONS
from estimator.identification.offline.starts import candidates
from estimator.signals.record import FloatArray, OutputKind
from hil.proof.real.black_box.series import Stretch

ORDERS = Orders()
"""The paper's: nA = nB = 4, one sample of delay."""

SOURCES = 3
"""Stretches that starts are taken from, the longest first."""

MOST_STARTS = 3
"""Starts that are followed, those of the least error first."""


REFUSED = 1e100
"""Error of every sample at an unstable A: above any other, and finite, as the solver needs it."""

LEAK = 0.1
"""Share of a position that a start forgets over a whole stretch."""


def fit_linear(stretches: Sequence[Stretch]) -> LinearModel:
    """Fit A and B to stretches of recordings, in free run.

    Parameters
    ----------
    stretches
        Of one sampling period.

    Returns
    -------
    LinearModel
        Stable; the best over all starts.
    """
    longest = sorted(stretches, key=lambda stretch: -int(stretch.used.sum()))[:SOURCES]
    starts = [model.theta for stretch in longest for model in _starts(stretch)]
    starts.sort(key=lambda theta: float(np.sum(_residual(theta, stretches) ** 2)))
    solve = partial(least_squares, _residual, args=(stretches,), x_scale="jac", max_nfev=MOST_EVALUATIONS)
    solutions = [solve(theta) for theta in starts[:MOST_STARTS]]
    best = min(solutions, key=lambda solution: float(solution.cost))
    return LinearModel.from_theta(best.x, ORDERS, stretches[0].sample_time_s)


def _starts(stretch: Stretch) -> list[LinearModel]:
    """Return stable models that one stretch suggests."""
    u = stretch.main_input - stretch.main_input.mean()
    y = stretch.output - stretch.output[stretch.used].mean()
    found = list(candidates(u, y, stretch.used, ORDERS, stretch.sample_time_s))
    if stretch.kind is OutputKind.POSITION:
        rate = np.gradient(stretch.output, stretch.sample_time_s)
        slower = Orders(ORDERS.na - 1, ORDERS.nb, ORDERS.nk)
        models = candidates(u, rate, stretch.used, slower, stretch.sample_time_s)
        found += [_integrated(model, LEAK / stretch.output.size) for model in models]
    return [model for model in found if model.is_stable]


def _integrated(model: LinearModel, leak: float) -> LinearModel:
    """Return a model with an integrator behind it, stable: it forgets the share ``leak`` in a sample."""
    A = np.convolve(model.A, [1.0, leak - 1.0])
    b = np.asarray(model.b) * model.sample_time_s
    return LinearModel(tuple(A[1:].tolist()), tuple(b.tolist()), model.nk, model.sample_time_s)


def _residual(theta: FloatArray, stretches: Sequence[Stretch]) -> FloatArray:
    model = LinearModel.from_theta(theta, ORDERS, stretches[0].sample_time_s)
    if not model.is_stable:
        return np.full(sum(int(stretch.used.sum()) for stretch in stretches), REFUSED)
    errors = [(simulate_linear(model, stretch) - stretch.output)[stretch.used] for stretch in stretches]
    return np.concatenate(errors)


def simulate_linear(model: LinearModel, stretch: Stretch) -> FloatArray:
    """Return the free run over a stretch, its own constant and initial state estimated where it is used; shape (n,)."""
    n = stretch.output.size
    driven = model.simulate(stretch.main_input)
    units = np.eye(ORDERS.n_states)
    own = np.column_stack([model.simulate(np.ones(n)), *(free_response(model.A, unit, n) for unit in units)])
    weight = np.linalg.norm(own[stretch.used], axis=0)
    columns = own / np.where(weight > 0.0, weight, 1.0)
    rest = (stretch.output - driven)[stretch.used]
    size = np.linalg.lstsq(columns[stretch.used], rest, rcond=None)[0]
    simulated: FloatArray = driven + columns @ size
    return simulated
