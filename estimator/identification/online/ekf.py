"""Extended Kalman filter (EKF) with the physical two-mass parameters among its states.

L. Ljung, Asymptotic Behavior of the Extended Kalman Filter as a Parameter Estimator for Linear Systems, IEEE Trans.
Automatic Control 24 (1979); B. D. O. Anderson and J. B. Moore, Optimal Filtering (Prentice Hall, 1979), chapter 8.
State x = [w_M, w_L, s, T_0, ln J_M, ln J_L, ln k, ln c] with the equations of motion of
:mod:`estimator.identification.online.two_mass_kernel`::

    K(t)      = P(t) H^T / (H P(t) H^T + R),       H = [1 0 .. 0]
    x(t|t)    = x(t) + K(t) (y(t) - w_M(t)),       P(t|t) = P(t) - K(t) H P(t)
    x(t+1)    = f(x(t|t), u(t+1-nk)),              P(t+1) = Phi P(t|t) Phi^T + Q,      Phi = df/dx

Logarithms, so that no inertia, stiffness or damping can turn negative. T_0 is a load torque that wanders: a hill, the
driver, and near a constant speed the viscous frictions, which are therefore given and not estimated. P is kept as
U D U^T: G. J. Bierman, Factorization Methods for Discrete Sequential Estimation (Academic Press, 1977), chapters V
(correction) and VI (prediction, Thornton's).

It wants the torque as it was held and the speed as it was read: raw samples at the rig's own period. A low-pass and a
longer period between the samples let the torque move in between, which the transfer functions of the other estimators
absorb and physical parameters can't.

Guards: as everywhere a masked sample, or one that is no number, leaves the estimate alone while time advances. An
output 100 standard deviations from the prediction is not used; twenty in a row, and the motion starts anew from them.
A parameter stays within a factor of 100 of its start value.
"""

from __future__ import annotations

import numpy as np

from estimator.identification.linear_model import Orders
from estimator.identification.online.ekf_kernel import FIRST_LOG, N_STATES, ORIGIN, START, block, kept, room
from estimator.identification.online.ekf_noise import EkfNoise
from estimator.identification.online.kernel_estimator import KernelEstimator
from estimator.identification.online.memory import Memory
from estimator.identification.online.regression_kernel import LEARNT
from estimator.identification.online.two_mass import ESTIMATED, TwoMass
from estimator.signals.record import FloatArray
from estimator.signals.settings import Requirement, is_positive, require


class Ekf(KernelEstimator):
    """The filter with its state; ``y_hat`` is the filtered motor speed.

    Parameters
    ----------
    start : TwoMass
        Start values of J_M, J_L, k, c; the frictions are kept.
    sample_time_s : float
        Sampling period [s].
    nk : int
        Total delay between torque and speed, at least the one sample of a held torque.
    noise : EkfNoise, optional
        What is noise, and how far the start values are trusted.

    Raises
    ------
    BadSetting
        If the sampling period is not above 0 or the delay is below 1.
    """

    def __init__(self, start: TwoMass, sample_time_s: float, nk: int = 1, noise: EkfNoise | None = None) -> None:
        require(
            "ekf",
            (
                Requirement("sample_time_s", sample_time_s, is_positive(sample_time_s), "a period above 0 s"),
                Requirement("nk", nk, nk >= 1, "1 or more: a held torque moves the next sample first"),
            ),
        )
        noise = EkfNoise() if noise is None else noise
        orders = Orders(3, 3, nk)
        n = N_STATES
        law = noise.law(start, sample_time_s)
        structure = np.array([orders.na, orders.nb, nk], dtype=np.float64)
        memory = Memory(kept(orders), {"structure": structure, "law": law}, room())
        memory["x"][:] = law[ORIGIN :]
        memory["U"][...] = np.eye(n)
        memory["D"][:] = memory["diagonal"][:] = law[START : ORIGIN]
        memory["physical"][:] = [start.J_M, start.J_L, start.k, start.c, start.b_M, start.b_L]
        super().__init__("ekf", block, orders, memory, ESTIMATED)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the physical parameters the samples so far do not determine."""
        if self._stands_still:
            return ESTIMATED
        now, start = self._memory["diagonal"][FIRST_LOG :], self._memory["law"][START : ORIGIN]
        still = now >= LEARNT * start[FIRST_LOG :]
        return tuple(name for name, is_open in zip(ESTIMATED, still, strict=True) if is_open)

    @property
    def physical(self) -> TwoMass:
        """Present parameters."""
        return TwoMass(*self._memory["physical"].tolist())

    @property
    def covariance(self) -> FloatArray:
        """Covariance of ln J_M, ln J_L, ln k, ln c as the filter believes it, shape (4, 4): relative variances."""
        U = self._memory["U"].T
        whole = (U * self._memory["D"]) @ U.T
        return np.asarray(whole[FIRST_LOG :, FIRST_LOG :], dtype=np.float64)
