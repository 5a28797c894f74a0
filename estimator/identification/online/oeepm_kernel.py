"""The compiled loop behind :mod:`estimator.identification.online.oeepm`; a single sample is a block of one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimator.compiled import compiled, inlined
from estimator.identification.linear_model import Orders
from estimator.identification.online.gain_kernel import dot
from estimator.identification.online.memory import Parts, Shapes
from estimator.identification.online.regression_kernel import (
    correct,
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


def past(of: Orders) -> Shapes:
    """Return its past values: predicted outputs, torques, a-posteriori errors."""
    return {"outputs": (of.na,), "inputs": (of.nk + of.nb,), "errors": (of.na,)}


@inlined
def step(u: float, y: float, okay: bool, m: Parts, row: Parts) -> None:
    """Run one sample through the equations of the extended prediction."""
    taken_input(u, m)
    of = orders(m, row)
    regressor(of, m.outputs, m.inputs, m.phi)
    for i in range(m.errors.shape[0]):
        m.phi[of[0] + of[1] + i] = m.errors[i]
    y_hat = dot(m.theta, m.phi)
    used = is_usable(y, okay, m.live)
    e_prior, e_post = 0.0, 0.0
    if used:
        e_prior = y - y_hat
        e_post = correct(e_prior, y, m.phi, m)
        y_hat = dot(m.theta, m.phi)
    y_hat = kept_in_bounds(y_hat, y, used, m.live)
    push(m.outputs, y_hat)
    push(m.errors, y - y_hat if used else 0.0)
    tell(y_hat, e_prior, e_post, used, is_stable(m.theta, of[0], m.f), m, row)


@compiled
def block(u: FloatArray, y: FloatArray, okay: BoolArray, memory: NDArray[np.void], out: NDArray[np.void]) -> None:
    """Run the samples of a block through, each into its row of ``out``."""
    for t in range(u.shape[0]):
        step(u[t], y[t], okay[t], memory[0], out[t])
