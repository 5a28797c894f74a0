"""Recursive output error with filtered observations (OEFO), the paper's algorithm.

Nevaranta, Montonen, Lindh, "Online Estimation of a Mechanical Driveline Parameters of a Hybrid Bus", EPE'18
ECCE Europe, equations (1) to (7); I. D. Landau and G. Zito, Digital Control Systems (Springer, 2006),
chapters 3 and 5. With t for the paper's k + 1 and the total delay nk (its d = 1 is nk = 1, see
``linear_model``)::
"""

from __future__ import annotations

from enum import Enum

import numpy as np
from numpy.typing import NDArray

from estimator.compiled import compiled, inlined
from estimator.errors import BadModel
from estimator.identification.linear_model import Orders
from estimator.identification.online.adaptation import Adaptation
from estimator.identification.online.recursive import USED, Parts, Shapes
from estimator.identification.online.regression import (
    ADAPT_FILTER,
    START_UP,
    RegressionEstimator,
    corrected,
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
    used = is_usable(y, okay, m.live)
    y_hat, e_prior, e_post = corrected(y, y, used, m.Phi, m)
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


class Filtering(Enum):
    """Where the filter 1 / L of the observations comes from."""

    FIXED = "fixed"
    ADAPTED = "adapted"


class Oefo(RegressionEstimator):
    """The estimator with its state; memory does not grow.

    ``y_hat`` is the output simulated from the torque alone, with the parameters of each moment.

    Parameters
    ----------
    L : ndarray, shape (m,)
        ``1, l_1 ..``: denominator of the observation filter; ``[1.0]`` is none (plain output error).
    orders : Orders
        Structure; the paper's is na = nb = 4, nk = 1.
    adaptation : Adaptation
        Adaptation-gain profile; the paper's by default.
    filtering : Filtering
        ADAPTED replaces L by each stable A_hat.
    start_up_samples : int
        Good samples at the start that are learnt from without the filter, Phi = phi.
    theta : ndarray, shape (na+nb,), optional
        Start values; zero by default. Choose a small initial gain with them.

    Raises
    ------
    BadSetting
        If ``start_up_samples`` is negative.
    BadModel
        If L does not start with 1, is not finite, or has a root on or outside the unit circle.
    BadShape
        If ``theta`` is not na + nb finite numbers.
    """

    def __init__(
        self,
        L: FloatArray,
        orders: Orders | None = None,
        adaptation: Adaptation | None = None,
        filtering: Filtering = Filtering.FIXED,
        start_up_samples: int = 0,
        theta: FloatArray | None = None,
    ) -> None:
        orders, adapted = Orders() if orders is None else orders, filtering is Filtering.ADAPTED
        L = _of_length(L, orders.na + 1) if adapted else L
        super().__init__(
            "oefo",
            block,
            past(orders, np.size(L)),
            orders,
            adaptation,
            L=L,
            adapts_filter=adapted,
            start_up_samples=start_up_samples,
            theta=theta,
        )


def _of_length(L: FloatArray, length: int) -> FloatArray:
    given = np.array(L, dtype=np.float64)
    if given.ndim != 1 or given.shape[0] > length:
        raise BadModel(
            f"oefo: L has order {given.size - 1}, expected at most na = {length - 1} where A_hat "
            "takes its place. Lower the order of L or keep it fixed."
        )
    return np.concatenate([given, np.zeros(length - given.shape[0])])
