"""The compiled loop behind :mod:`estimator.identification.online.oefo`; a single sample is a block of one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimator.compiled import compiled, inlined
from estimator.identification.linear_model import Orders
from estimator.identification.online.gain_kernel import dot
from estimator.identification.online.memory import Parts, Shapes
from estimator.identification.online.regression_kernel import (
    ADAPT_FILTER,
    START_UP,
    USED,
    correct,
    filtered,
    is_stable,
    is_usable,
    kept_in_bounds,
    orders,
    push,
    regressor,
    taken_input,
    tell,
)
from estimator.signals.record import BoolArray, FloatArray


def past(of: Orders, n_L: int) -> Shapes:
    """Return its past values: predicted outputs, torques, and both filtered by the n_L coefficients of 1 / L."""
    return {
        "outputs": (of.na,),
        "inputs": (of.nk + of.nb,),
        "outputs_f": (max(of.na, n_L - 1),),
        "inputs_f": (max(of.nk + of.nb, n_L - 1),),
    }


@inlined
def step(u: float, y: float, okay: bool, m: Parts, row: Parts) -> None:
    """Run one sample through equations (1) to (7)."""
    u = taken_input(u, m)
    push(m.inputs_f, filtered(u, m.L, m.inputs_f))
    of = orders(m, row)
    regressor(of, m.outputs, m.inputs, m.phi)
    if m.live[USED] < m.structure[START_UP]:
        regressor(of, m.outputs, m.inputs, m.Phi)
    else:
        regressor(of, m.outputs_f, m.inputs_f, m.Phi)
    y_hat = dot(m.theta, m.phi)
    used = is_usable(y, okay, m.live)
    e_prior, e_post = 0.0, 0.0
    if used:
        e_prior = y - y_hat
        e_post = correct(e_prior, y, m.Phi, m)
        y_hat = dot(m.theta, m.phi)
    y_hat = kept_in_bounds(y_hat, y, used, m.live)
    stable = is_stable(m.theta, of[0], m.f)
    if stable and m.structure[ADAPT_FILTER] == 1.0:
        for i in range(of[0]):
            m.L[1 + i] = m.theta[i]
    push(m.outputs, y_hat)
    push(m.outputs_f, filtered(y_hat, m.L, m.outputs_f))
    tell(y_hat, e_prior, e_post, used, stable, m, row)


@compiled
def block(u: FloatArray, y: FloatArray, okay: BoolArray, memory: NDArray[np.void], out: NDArray[np.void]) -> None:
    """Run the samples of a block through, each into its row of ``out``."""
    for t in range(u.shape[0]):
        step(u[t], y[t], okay[t], memory[0], out[t])
