"""Recursive output error with filtered observations (OEFO), the paper's algorithm.

Nevaranta, Montonen, Lindh, "Online Estimation of a Mechanical Driveline Parameters of a Hybrid Bus", EPE'18
ECCE Europe, equations (1) to (7); I. D. Landau and G. Zito, Digital Control Systems (Springer, 2006),
chapters 3 and 5. With t for the paper's k + 1 and the total delay nk (its d = 1 is nk = 1, see
``linear_model``)::

    phi(t-1)^T = [-yhat(t-1) .. -yhat(t-na), u(t-nk) .. u(t-nk-nb+1)]                       (3)
    Phi(t-1)   = phi(t-1) / L(q^-1)                                                          (7)
    e0(t)      = y(t) - theta(t-1)^T phi(t-1)                     a priori error             (1)
    e(t)       = e0(t) / (1 + Phi^T F(t-1) Phi)                   a posteriori error         (6)
    theta(t)   = theta(t-1) + F(t-1) Phi e(t)                                                (4)
    F(t)^-1    = lambda_1 F(t-1)^-1 + lambda_2 Phi Phi^T                                     (5)
    yhat(t)    = theta(t)^T phi(t-1)                              fed back into phi

One departure from the printed paper, on purpose: its (3) shows measured outputs -y in the regressor. That is
the least-squares regressor; noise on y would bias it. An output-error algorithm (the paper's own name for it,
and Landau and Zito's chapter 5) has the *predicted* outputs there, and that is what stands here.

L is an estimate of A from an earlier batch output-error model (the paper), or follows the present A_hat
(:attr:`Filtering.ADAPTED`, known as AFOLOE). Then the last A_hat that was stable keeps filtering while the
present one is not.

The filter may be left out for the first samples (``start_up_samples``; the printed algorithm is 0). With
theta(0) = 0 and a large F(0) the first predictions are a few times too large, and 1 / L of a lightly damped
pair makes that ten times more: F then shrinks on what was no information, and theta stays where it was
thrown. In 24 simulated cruises the worst damping error fell from 10 % to 1.5 % by leaving the filter out for
80 samples.

Guards, since nothing may raise or run away in the loop: a masked output, or one that is no number or beyond
1e30, leaves theta and F as they are while time goes on with the prediction; an input of that kind is held,
and its samples are masked; a prediction beyond 1000 times the largest output seen starts again from the
measured one; without excitation F stops growing at tr F(0).
"""

from __future__ import annotations

from enum import Enum

import numpy as np

from estimator.errors import BadModel, BadShape
from estimator.identification.linear_model import LinearModel, Orders
from estimator.identification.online import oefo_kernel as kernel
from estimator.identification.online.adaptation import Adaptation, DecreasingThenConstantTrace
from estimator.identification.online.recursive import Estimate, Reason, ReasonArray, Trajectory
from estimator.signals.record import BoolArray, FloatArray
from estimator.signals.settings import Requirement, require

_REASONS = tuple(Reason)


class Filtering(Enum):
    """Where the filter 1 / L of the observations comes from."""

    FIXED = "fixed"
    ADAPTED = "adapted"


class Oefo:
    """The estimator with its state; memory does not grow.

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
        filtering: Filtering = Filtering.FIXED,
        start_up_samples: int = 0,
    ) -> None:
        start_up = Requirement("start_up_samples", start_up_samples, start_up_samples >= 0, "0 or more")
        require("OEFO", (start_up,))
        self._orders = Orders() if orders is None else orders
        law = (DecreasingThenConstantTrace() if adaptation is None else adaptation).law
        n = self._orders.n_parameters
        self._L = self._filter(_checked(L), filtering)
        self._theta = np.zeros(n)
        self._U, self._D = np.eye(n), np.full(n, law.initial_gain)
        self._law = law.as_array()
        self._live = np.array([law.lambda1, 0.0, 0.0, 0.0, 0.0])
        depth = max(self._orders.na, self._orders.nk + self._orders.nb, self._L.shape[0])
        self._past = np.zeros((4, depth))
        self._work = np.zeros((4, n))
        adapt = 1 if filtering is Filtering.ADAPTED else 0
        self._structure = np.array([self._orders.na, self._orders.nb, self._orders.nk, adapt, start_up_samples])
        self._one = (np.zeros(1), np.zeros(1), np.ones(1, dtype=np.bool_))
        self._one_out = _outputs(1, n)
        # An empty block compiles the loop now, so that the first cycle on the rig does not wait for it.
        self.run(np.empty(0), np.empty(0), np.empty(0, dtype=np.bool_))

    def _filter(self, L: FloatArray, filtering: Filtering) -> FloatArray:
        """Return L as the loop's own array; adapted, it has the length of A_hat from the start."""
        if filtering is Filtering.FIXED:
            return L
        own = np.zeros(self._orders.na + 1)
        if L.shape[0] > own.shape[0]:
            raise BadModel(
                f"OEFO: L has order {L.shape[0] - 1}, expected at most na = {own.shape[0] - 1} where A_hat "
                "takes its place. Lower the order of L or keep it fixed."
            )
        own[: L.shape[0]] = L
        return own

    @property
    def orders(self) -> Orders:
        """Structure of the model."""
        return self._orders

    @property
    def theta(self) -> FloatArray:
        """Present parameters, shape (na+nb,), a copy."""
        return self._theta.copy()

    @property
    def F(self) -> FloatArray:
        """Adaptation gain, shape (na+nb, na+nb), symmetric positive definite."""
        product: FloatArray = (self._U * self._D) @ self._U.T
        return product

    @property
    def L(self) -> FloatArray:
        """Denominator of the filter in use, a copy."""
        return self._L.copy()

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the parameters that still owe more than a tenth to their start value."""
        weak = np.diag(self.F) >= kernel.LEARNT * self._law[kernel.INITIAL_GAIN]
        return tuple(name for name, is_weak in zip(self._orders.names, weak, strict=True) if is_weak)

    def model(self, sample_time_s: float) -> LinearModel:
        """Return the present parameters as a model with the sampling period of the samples [s]."""
        return LinearModel.from_theta(self.theta, self._orders, sample_time_s)

    def update(self, u: float, y: float, okay: bool = True) -> Estimate:
        """Take one sample; correct ``theta`` by the filtered output error.

        Parameters
        ----------
        u : float
            Total torque of this sample [Nm].
        y : float
            Speed of this sample [rad/s].
        okay : bool
            False masks the sample: time advances, ``theta`` does not change. A value that is not finite masks
            it too.

        Returns
        -------
        Estimate
            Parameters, status with reason, and errors.

        Notes
        -----
        Cost O((na+nb)^2); memory constant. Never raises on a value.
        """
        self._one[0][0], self._one[1][0], self._one[2][0] = u, y, okay
        self._advance(*self._one, *self._one_out)
        out, used, reason = self._one_out
        n = self._theta.shape[0]
        y_hat, e_prior, e_post = out[0, n:].tolist()
        return Estimate(self._theta.copy(), _REASONS[reason[0]], bool(used[0]), y_hat, e_prior, e_post)

    def run(self, u: FloatArray, y: FloatArray, okay: BoolArray) -> Trajectory:
        """Take a block of samples, with the same bits as one by one.

        Parameters
        ----------
        u, y, okay : ndarray, shape (N,)
            Input, output, mask. They are not changed.

        Returns
        -------
        Trajectory
            Every estimate of the block.

        Raises
        ------
        BadShape
            If the three do not have one shape (N,).
        """
        if not (u.ndim == 1 and u.shape == y.shape == okay.shape):
            raise BadShape(
                f"OEFO: u, y and okay have the shapes {u.shape}, {y.shape}, {okay.shape}, expected one shape "
                "(N,). Give every signal one value per sample."
            )
        n = self._theta.shape[0]
        out, used, reason = _outputs(u.shape[0], n)
        self._advance(
            np.ascontiguousarray(u, dtype=np.float64),
            np.ascontiguousarray(y, dtype=np.float64),
            np.ascontiguousarray(okay, dtype=np.bool_),
            out,
            used,
            reason,
        )
        y_hat, e_prior, e_post = (out[:, n + column] for column in range(3))
        return Trajectory(out[:, :n], y_hat, e_prior, e_post, used, reason)

    def _advance(
        self,
        u: FloatArray,
        y: FloatArray,
        okay: BoolArray,
        out: FloatArray,
        used: BoolArray,
        reason: ReasonArray,
    ) -> None:
        kernel.oefo_block(
            u,
            y,
            okay,
            self._structure,
            self._law,
            self._live,
            self._theta,
            self._U,
            self._D,
            self._L,
            self._past,
            self._work,
            out,
            used,
            reason,
        )


def _outputs(n_samples: int, n_parameters: int) -> tuple[FloatArray, BoolArray, ReasonArray]:
    out = np.zeros((n_samples, n_parameters + 3))
    return out, np.zeros(n_samples, dtype=np.bool_), np.zeros(n_samples, dtype=np.int8)


def _checked(L: FloatArray) -> FloatArray:
    """Return a copy of L, or refuse one that could not filter."""
    own = np.array(L, dtype=np.float64)
    if own.ndim != 1 or own.shape[0] == 0 or not np.isfinite(own).all() or own[0] != 1.0:
        raise BadModel(f"OEFO: L is {L}, expected finite coefficients 1, l_1, l_2 .. of a polynomial in q^-1.")
    largest = float(np.abs(np.roots(own)).max(initial=0.0))
    if largest >= 1.0:
        raise BadModel(
            f"OEFO: L has a root of magnitude {largest:.4g}, expected all inside the unit circle. Take A "
            "of a stable output-error model."
        )
    return own
