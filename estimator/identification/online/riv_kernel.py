"""The compiled loop behind :mod:`estimator.identification.online.riv`; a single sample is a block of one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimator.compiled import compiled, inlined
from estimator.identification.linear_model import Orders
from estimator.identification.online.gain_kernel import dot
from estimator.identification.online.memory import Parts, Shapes
from estimator.identification.online.regression_kernel import (
    IS_STABLE,
    LARGEST,
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
    """Return its past values.

    Outputs of the auxiliary model and torques; those two and the measured outputs, filtered by the n_L coefficients of
    1 / L; parameters of the auxiliary model.
    """
    outputs_f, inputs_f = (max(of.na, n_L - 1),), (max(of.nk + of.nb, n_L - 1),)
    filtered_rows = {"auxiliary_f": outputs_f, "outputs_f": outputs_f, "inputs_f": inputs_f}
    return {"outputs": (of.na,), "inputs": (of.nk + of.nb,), **filtered_rows, "auxiliary": (of.n_parameters,)}


@inlined
def step(u: float, y: float, okay: bool, m: Parts, row: Parts) -> None:
    """Run one sample through the equations of the instrumental variable."""
    u = taken_input(u, m)
    push(m.inputs_f, filtered(u, m.L, m.inputs_f))
    of = orders(m, row)
    regressor(of, m.outputs, m.inputs, m.phi)
    simulated = kept_in_bounds(dot(m.auxiliary, m.phi), y, False, m.live)
    push(m.outputs, simulated)
    regressor(of, m.outputs_f, m.inputs_f, m.phi)
    if m.live[USED] < m.structure[START_UP] or m.live[IS_STABLE] == 0.0:
        regressor(of, m.outputs_f, m.inputs_f, m.Phi)
    else:
        regressor(of, m.auxiliary_f, m.inputs_f, m.Phi)
    used = is_usable(y, okay, m.live)
    y_f = filtered(y if okay and abs(y) <= LARGEST else simulated, m.L, m.outputs_f)
    e_prior, e_post = 0.0, 0.0
    if used:
        e_prior = y_f - dot(m.theta, m.phi)
        e_post = correct(e_prior, y, m.Phi, m)
    push(m.outputs_f, y_f)
    push(m.auxiliary_f, filtered(simulated, m.L, m.auxiliary_f))
    stable = is_stable(m.theta, of[0], m.f)
    m.live[IS_STABLE] = 1.0 if stable else 0.0
    if stable:
        for i in range(m.theta.shape[0]):
            m.auxiliary[i] = m.theta[i]
    tell(simulated, e_prior, e_post, used, stable, m, row)


@compiled
def block(u: FloatArray, y: FloatArray, okay: BoolArray, memory: NDArray[np.void], out: NDArray[np.void]) -> None:
    """Run the samples of a block through, each into its row of ``out``."""
    for t in range(u.shape[0]):
        step(u[t], y[t], okay[t], memory[0], out[t])
