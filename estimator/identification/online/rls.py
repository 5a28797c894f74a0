"""Recursive least squares (RLS): the yardstick, biased by every noise on the measured output.

L. Ljung, System Identification, 2nd ed. (Prentice Hall, 1999), section 11.2; I. D. Landau and G. Zito, Digital
Control Systems (Springer, 2006), section 3.2. In the notation of :mod:`estimator.identification.online.oefo`::

    phi(t-1)^T = [-y(t-1) .. -y(t-na), u(t-nk) .. u(t-nk-nb+1)]        measured outputs
    Phi(t-1)   = phi(t-1)                                              nothing is filtered

with equations (1) and (4) to (6) of the paper. It minimises the sum of squares of A y - B u, and is right where that
is white. White noise w on the *measured output* alone makes it A w, which correlates with phi: theta is then wrong
however long the run, and the damping of a light resonance most of all. That bias is why the paper takes another.

A missing output is missing from the next na regressors too: they are left out, exactly as rows of a least-squares
problem. In time advances with the prediction.
"""

from __future__ import annotations

from estimator.identification.linear_model import Orders
from estimator.identification.online import rls_kernel as kernel
from estimator.identification.online.adaptation import Adaptation
from estimator.identification.online.regression import RegressionEstimator
from estimator.signals.record import FloatArray


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
        super().__init__("rls", kernel.block, kernel.past(orders), orders, adaptation, theta=theta)
