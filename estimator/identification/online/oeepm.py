"""Recursive output error with extended prediction model (OEEPM): the noise is modelled, so that no filter is needed.

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

from estimator.identification.linear_model import Orders
from estimator.identification.online import oeepm_kernel as kernel
from estimator.identification.online.adaptation import Adaptation
from estimator.identification.online.regression import RegressionEstimator
from estimator.signals.record import FloatArray


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
            kernel.block,
            kernel.past(orders),
            orders,
            adaptation,
            theta=theta,
            extra_names=tuple(f"h_{i}" for i in range(1, orders.na + 1)),
        )

    @property
    def h(self) -> FloatArray:
        """Present coefficients of the extended prediction, shape (na,), a copy."""
        return self._memory["theta"][self.orders.n_parameters :].copy()
