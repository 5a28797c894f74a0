"""Recursive estimators to compare OEFO with: least squares, instrumental variable, extended prediction.

In the notation of :mod:`estimator.identification.online.oefo`, its equations (1) and (4) to (6).

**Recursive least squares (RLS): the yardstick, biased by every noise on the measured output.**

L. Ljung, System Identification, 2nd ed. (Prentice Hall, 1999), section 11.2; I. D. Landau and G. Zito, Digital
Control Systems (Springer, 2006), section 3.2. In the notation of :mod:`estimator.identification.online.oefo`::

    phi(t-1)^T = [-y(t-1) .. -y(t-na), u(t-nk) .. u(t-nk-nb+1)]        measured outputs
    Phi(t-1)   = phi(t-1)                                              nothing is filtered

with equations (1) and (4) to (6) of the paper. It minimises the sum of squares of A y - B u, and is right where that
is white. White noise w on the *measured output* alone makes it A w, which correlates with phi: theta is then wrong
however long the run, and the damping of a light resonance most of all. That bias is why the paper takes another.

A missing output is missing from the next na regressors too: they are left out, exactly as rows of a least-squares
problem. In time advances with the prediction.

**Recursive instrumental variable with auxiliary model (RIV): least squares, with the noise taken out of its gain.**

P. C. Young, Recursive Estimation and Time-Series Analysis, 2nd ed. (Springer, 2011), chapter 7; I. D. Landau and G.
Zito, Digital Control Systems (Springer, 2006), section 5.5 (IVAM). An auxiliary model, the present estimate as long as
it is stable and else the last that was, simulates the output from the torque alone::

    x(t)       = theta_s^T [-x(t-1) .. -x(t-na), u(t-nk) .. u(t-nk-nb+1)]               auxiliary model
    phi(t-1)   = [-y(t-1) .. -y(t-na), u(t-nk) .. u(t-nk-nb+1)] / L(q^-1)               measured outputs
    Phi(t-1)   = [-x(t-1) .. -x(t-na), u(t-nk) .. u(t-nk-nb+1)] / L(q^-1)               instruments
    e0(t)      = y(t) / L(q^-1) - theta(t-1)^T phi(t-1)

with equations (4) to (6). The instruments carry no measurement noise, so that noise of any colour on the output does
not bias the estimate. L = A makes A w / L white for white w: then it is Young's refined estimator (SRIV), and no
unbiased one has less variance. L = 1 is the plain instrumental variable, whose variance at a light resonance is large.

For the first ``start_up_samples``, and while A_hat is not stable, it is least squares, Phi = phi: what a model made of
nothing simulates is no instrument, and (4) with a bad one moves away from the truth instead of towards it.
In place of a missing output its simulated one stands in phi, which at the true parameters is right but for the noise.
``y_hat`` is the auxiliary model's output; the errors are filtered by 1 / L.

**Recursive output error with extended prediction model (OEEPM): the noise is modelled, so that no filter is needed.**

I. D. Landau and G. Zito, Digital Control Systems (Springer, 2006), section 5.4 (output error with extended
prediction model). The a-posteriori errors stand in the regressor next to the predicted outputs::

    phi(t-1)^T = [-yhat(t-1) .. -yhat(t-na), u(t-nk) .. u(t-nk-nb+1), e(t-1) .. e(t-na)]
    Phi(t-1)   = phi(t-1)
    theta^T    = [a_1 .. a_na, b_1 .. b_nb, h_1 .. h_na],          h_i = c_i - a_i

with equations (1) and (4) to (6), and e(t) = y(t) - theta(t)^T phi(t-1). It is the optimal predictor of
A y = B u + C w, w white: with yhat = y - e the first terms give -A* y + B u + C* e. White noise on the output alone is
C = A, that is h = 0. Convergence is certain without noise, and with it where 1/C - 1/2 is strictly positive real;
with C = A lightly damped it is not, which is what OEFO's filter is for. ``theta`` of the interface is a and b alone;
the h_i are :attr:`Trajectory.extra`'s business and :attr:`OeEpm.h`.
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
    """The estimator with its state; ``y_hat`` predicts one step ahead, from measured outputs.

    Parameters
    ----------
    orders : Orders
        Structure of the model.
    adaptation : Adaptation
        Adaptation-gain profile; the paper's by default.
    theta : ndarray, shape (na+nb,), optional
        Start values; zero by default.
    """

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
    """The estimator with its state.

    Parameters
    ----------
    L : ndarray, shape (m,)
        ``1, l_1 ..``: denominator of the filter of all signals; ``[1.0]`` is none.
    orders : Orders
        Structure of the model.
    adaptation : Adaptation
        Adaptation-gain profile; the paper's by default.
    start_up_samples : int
        Good samples at the start that are learnt from by least squares.
    theta : ndarray, shape (na+nb,), optional
        Start values; zero by default.

    Raises
    ------
    BadSetting
        If ``start_up_samples`` is negative.
    BadModel
        If L does not start with 1, is not finite, or has a root on or outside the unit circle.
    """

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
    """The estimator with its state; ``y_hat`` predicts from the torque and the errors so far.

    Parameters
    ----------
    orders : Orders
        Structure of the model.
    adaptation : Adaptation
        Adaptation-gain profile; the paper's by default.
    theta : ndarray, shape (na+nb,), optional
        Start values of a and b; zero by default.
    """

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
