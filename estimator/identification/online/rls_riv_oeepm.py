"""Recursive estimators to compare OEFO with: least squares, instrumental variable, extended prediction.

In the notation of :mod:`estimator.identification.online.oefo`, its equations (1) and (4) to (6).

**Recursive least squares (RLS): the yardstick, biased by every noise on the measured output.**

L. Ljung, System Identification, 2nd ed. (Prentice Hall, 1999), section 11.2; I. D. Landau and G. Zito, Digital
Control Systems (Springer, 2006), section 3.2. In the notation of :mod:`estimator.identification.online.oefo`::
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimator.compiled import compiled, inlined
from estimator.identification.linear_model import Orders
from estimator.identification.online.adaptation import Adaptation, dot
from estimator.identification.online.recursive import HELD_OUTPUTS, IS_STABLE, USED, Parts, Shapes
from estimator.identification.online.regression import (
    LARGEST,
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


def rls_past(of: Orders) -> Shapes:
    """Return its past values: measured outputs, torques."""
    return {"outputs": (of.na,), "inputs": (of.nk + of.nb,)}


@inlined
def rls_step(u: float, y: float, okay: bool, m: Parts, row: Parts) -> None:
    """Run one sample through the equations of recursive least squares."""
    taken_input(u, m)
    of = orders(m, row)
    regressor(of, m.outputs, m.inputs, m.phi)
    measured = okay and abs(y) <= LARGEST
    used = is_usable(y, okay, m.live) and m.live[HELD_OUTPUTS] == 0.0
    y_hat, e_prior, e_post = corrected(y, y, used, m.phi, m)
    y_hat = kept_in_bounds(y_hat, y, used, m.live)
    m.live[HELD_OUTPUTS] = max(m.live[HELD_OUTPUTS] - 1.0, 0.0) if measured else float(of[0])
    push(m.outputs, y if measured else y_hat)
    tell(y_hat, e_prior, e_post, used, is_stable(m.theta, of[0], m.f), m, row)


@compiled
def rls_block(u: FloatArray, y: FloatArray, okay: BoolArray, memory: NDArray[np.void], out: NDArray[np.void]) -> None:
    """Run the samples of a block through, each into its row of ``out``."""
    for t in range(u.shape[0]):
        rls_step(u[t], y[t], okay[t], memory[0], out[t])


class Rls(RegressionEstimator):
    """The estimator with its state; ``y_hat`` predicts one step ahead, from measured outputs."""

    def __init__(
        self, orders: Orders | None = None, adaptation: Adaptation | None = None, theta: FloatArray | None = None
    ) -> None:
        orders = Orders() if orders is None else orders
        super().__init__("rls", rls_block, rls_past(orders), orders, adaptation, theta=theta)


def riv_past(of: Orders, n_L: int) -> Shapes:
    """Return its past values.

    Outputs of the auxiliary model and torques; those two and the measured outputs, filtered by the n_L coefficients of
    1 / L; parameters of the auxiliary model.
    """
    outputs_f, inputs_f = (max(of.na, n_L - 1),), (max(of.nk + of.nb, n_L - 1),)
    filtered_rows = {"auxiliary_f": outputs_f, "outputs_f": outputs_f, "inputs_f": inputs_f}
    return {"outputs": (of.na,), "inputs": (of.nk + of.nb,), **filtered_rows, "auxiliary": (of.n_parameters,)}


@inlined
def riv_step(u: float, y: float, okay: bool, m: Parts, row: Parts) -> None:
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
    _, e_prior, e_post = corrected(y_f, y, used, m.Phi, m)
    push(m.outputs_f, y_f)
    push(m.auxiliary_f, filtered(simulated, m.L, m.auxiliary_f))
    stable = is_stable(m.theta, of[0], m.f)
    m.live[IS_STABLE] = 1.0 if stable else 0.0
    if stable:
        for i in range(m.theta.shape[0]):
            m.auxiliary[i] = m.theta[i]
    tell(simulated, e_prior, e_post, used, stable, m, row)


@compiled
def riv_block(u: FloatArray, y: FloatArray, okay: BoolArray, memory: NDArray[np.void], out: NDArray[np.void]) -> None:
    """Run the samples of a block through, each into its row of ``out``."""
    for t in range(u.shape[0]):
        riv_step(u[t], y[t], okay[t], memory[0], out[t])


class Riv(RegressionEstimator):
    """The estimator with its state."""

    def __init__(
        self,
        L: FloatArray,
        orders: Orders | None = None,
        adaptation: Adaptation | None = None,
        start_up_samples: int = 0,
        theta: FloatArray | None = None,
    ) -> None:
        orders = Orders() if orders is None else orders
        super().__init__(
            "riv",
            riv_block,
            riv_past(orders, np.size(L)),
            orders,
            adaptation,
            L=L,
            start_up_samples=start_up_samples,
            theta=theta,
        )


def oeepm_past(of: Orders) -> Shapes:
    """Return its past values: predicted outputs, torques, a-posteriori errors."""
    return {"outputs": (of.na,), "inputs": (of.nk + of.nb,), "errors": (of.na,)}


@inlined
def oeepm_step(u: float, y: float, okay: bool, m: Parts, row: Parts) -> None:
    """Run one sample through the equations of the extended prediction."""
    taken_input(u, m)
    of = orders(m, row)
    regressor(of, m.outputs, m.inputs, m.phi)
    for i in range(m.errors.shape[0]):
        m.phi[of[0] + of[1] + i] = m.errors[i]
    used = is_usable(y, okay, m.live)
    y_hat, e_prior, e_post = corrected(y, y, used, m.phi, m)
    y_hat = kept_in_bounds(y_hat, y, used, m.live)
    push(m.outputs, y_hat)
    push(m.errors, y - y_hat if used else 0.0)
    tell(y_hat, e_prior, e_post, used, is_stable(m.theta, of[0], m.f), m, row)


@compiled
def oeepm_block(u: FloatArray, y: FloatArray, okay: BoolArray, memory: NDArray[np.void], out: NDArray[np.void]) -> None:
    """Run the samples of a block through, each into its row of ``out``."""
    for t in range(u.shape[0]):
        oeepm_step(u[t], y[t], okay[t], memory[0], out[t])


class OeEpm(RegressionEstimator):
    """The estimator with its state; ``y_hat`` predicts from the torque and the errors so far."""

    def __init__(
        self, orders: Orders | None = None, adaptation: Adaptation | None = None, theta: FloatArray | None = None
    ) -> None:
        orders = Orders() if orders is None else orders
        super().__init__(
            "oeepm",
            oeepm_block,
            oeepm_past(orders),
            orders,
            adaptation,
            theta=theta,
            extra_names=tuple(f"h_{i}" for i in range(1, orders.na + 1)),
        )

    @property
    def h(self) -> FloatArray:
        """Present coefficients of the extended prediction, shape (na,), a copy."""
        return self._memory["theta"][self.orders.n_parameters :].copy()
