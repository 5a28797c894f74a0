"""The compiled loop behind :mod:`estimator.identification.online.rls`; a single sample is a block of one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimator.compiled import compiled, inlined
from estimator.identification.linear_model import Orders
from estimator.identification.online.gain_kernel import dot
from estimator.identification.online.memory import Parts, Shapes
from estimator.identification.online.regression_kernel import (
    HELD_OUTPUTS,
    LARGEST,
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
    """Return its past values: measured outputs, torques."""
    return {"outputs": (of.na,), "inputs": (of.nk + of.nb,)}


@inlined
def step(u: float, y: float, okay: bool, m: Parts, row: Parts) -> None:
    """Run one sample through the equations of recursive least squares."""
    taken_input(u, m)
    of = orders(m, row)
    regressor(of, m.outputs, m.inputs, m.phi)
    y_hat = dot(m.theta, m.phi)
    measured = okay and abs(y) <= LARGEST
    used = is_usable(y, okay, m.live) and m.live[HELD_OUTPUTS] == 0.0
    e_prior, e_post = 0.0, 0.0
    if used:
        e_prior = y - y_hat
        e_post = correct(e_prior, y, m.phi, m)
        y_hat = dot(m.theta, m.phi)
    y_hat = kept_in_bounds(y_hat, y, used, m.live)
    m.live[HELD_OUTPUTS] = max(m.live[HELD_OUTPUTS] - 1.0, 0.0) if measured else float(of[0])
    push(m.outputs, y if measured else y_hat)
    tell(y_hat, e_prior, e_post, used, is_stable(m.theta, of[0], m.f), m, row)


@compiled
def block(u: FloatArray, y: FloatArray, okay: BoolArray, memory: NDArray[np.void], out: NDArray[np.void]) -> None:
    """Run the samples of a block through, each into its row of ``out``."""
    for t in range(u.shape[0]):
        step(u[t], y[t], okay[t], memory[0], out[t])
