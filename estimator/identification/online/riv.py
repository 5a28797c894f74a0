"""Recursive instrumental variable with auxiliary model (RIV): least squares, with the noise taken out of its gain.

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
"""

from __future__ import annotations

import numpy as np

from estimator.identification.linear_model import Orders
from estimator.identification.online import riv_kernel as kernel
from estimator.identification.online.adaptation import Adaptation
from estimator.identification.online.regression import RegressionEstimator
from estimator.signals.record import FloatArray


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
            kernel.block,
            kernel.past(orders, np.size(L)),
            orders,
            adaptation,
            L=L,
            start_up_samples=start_up_samples,
            theta=theta,
        )
