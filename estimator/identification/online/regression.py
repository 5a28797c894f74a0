"""What the four estimators of a transfer function share: structure, adaptation gain, filter, and start values."""

from __future__ import annotations

import numpy as np

from estimator.errors import BadModel, BadShape
from estimator.identification.linear_model import Orders
from estimator.identification.online import gain_kernel, regression_kernel
from estimator.identification.online.adaptation import Adaptation, DecreasingThenConstantTrace, GainLaw
from estimator.identification.online.kernel_estimator import Block, KernelEstimator
from estimator.identification.online.memory import Memory, Shapes
from estimator.signals.record import FloatArray
from estimator.signals.settings import Requirement, require


class RegressionEstimator(KernelEstimator):
    """An estimator that corrects theta along F Phi; what differs is what stands in phi and Phi.

    Parameters
    ----------
    name, block
        As for every compiled estimator.
    past : mapping
        Shapes of the past values its step keeps, by name.
    orders : Orders
        Structure of the model.
    adaptation : Adaptation, optional
        Adaptation-gain profile; the paper's by default.
    L : ndarray, shape (m,)
        ``1, l_1 ..``: denominator of the observation filter.
    adapts_filter : bool
        Whether A_hat takes the place of L.
    start_up_samples : int
        Good samples at the start that the step treats apart.
    theta : ndarray, shape (na+nb,), optional
        Start values; zero by default. Choose a small initial gain with them.
    extra_names : tuple of str
        Parameters besides those of the transfer function, estimated along.

    Raises
    ------
    BadSetting
        If ``start_up_samples`` is negative.
    BadModel
        If L can't filter: see :func:`checked_filter`.
    BadShape
        If ``theta`` is not na + nb finite numbers.
    """

    def __init__(
        self,
        name: str,
        block: Block,
        past: Shapes,
        orders: Orders,
        adaptation: Adaptation | None,
        *,
        L: FloatArray | None = None,
        adapts_filter: bool = False,
        start_up_samples: int = 0,
        theta: FloatArray | None = None,
        extra_names: tuple[str, ...] = (),
    ) -> None:
        require(name, (Requirement("start_up_samples", start_up_samples, start_up_samples >= 0, "0 or more"),))
        law = (DecreasingThenConstantTrace() if adaptation is None else adaptation).law
        n = orders.n_parameters + len(extra_names)
        own_L = np.ones(1) if L is None else checked_filter(name, L)
        structure = np.array([orders.na, orders.nb, orders.nk, adapts_filter, start_up_samples], dtype=np.float64)
        shapes = {**regression_kernel.kept(n), "L": own_L.shape, **past}
        memory = Memory(shapes, {"structure": structure, "law": law.as_array(n)}, regression_kernel.room(n))
        _begin(memory, own_L, law)
        if theta is not None:
            memory["theta"][: orders.n_parameters] = _start_values(name, theta, orders)
        super().__init__(name, block, orders, memory, extra_names)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the parameters the samples so far do not determine."""
        if self._stands_still:
            return self._orders.names
        start = gain_kernel.INFORMATION_GAIN if self._judged_apart else self._memory["law"][gain_kernel.INITIAL_GAIN]
        still = self._memory["diagonal"] >= regression_kernel.LEARNT * start
        return tuple(name for name, is_open in zip(self._orders.names, still, strict=False) if is_open)

    @property
    def F(self) -> FloatArray:
        """Adaptation gain, shape (n, n) with n the number of parameters, extra ones last; a copy."""
        U = self._memory["U"].T
        return np.asarray((U * self._memory["D"]) @ U.T, dtype=np.float64)

    @property
    def L(self) -> FloatArray:
        """Denominator of the observation filter in use, leading 1; a copy."""
        return self._memory["L"].copy()

    @property
    def _judged_apart(self) -> bool:
        law = self._memory["law"]
        return bool(law[gain_kernel.LAMBDA2] == 0.0 or law[gain_kernel.HOLDS_AT_ONCE] == 1.0)


def checked_filter(name: str, L: FloatArray) -> FloatArray:
    """Return a copy of L.

    Raises
    ------
    BadModel
        If L does not start with 1, is not finite, or has a root on or outside the unit circle.
    """
    own = np.array(L, dtype=np.float64)
    if own.ndim != 1 or own.shape[0] == 0 or not np.isfinite(own).all() or own[0] != 1.0:
        raise BadModel(f"{name}: L is {L}, expected finite coefficients 1, l_1, l_2 .. of a polynomial in q^-1.")
    largest = float(np.abs(np.roots(own)).max(initial=0.0))
    if largest >= 1.0:
        raise BadModel(
            f"{name}: L has a root of magnitude {largest:.4g}, expected all inside the unit circle. Take A "
            "of a stable output-error model."
        )
    return own


def _begin(memory: Memory, L: FloatArray, law: GainLaw) -> None:
    memory["U"][...] = memory["known_U"][...] = np.eye(memory["theta"].shape[0])
    memory["D"][:], memory["known_D"][:] = law.initial_gain, gain_kernel.INFORMATION_GAIN
    memory["diagonal"][:] = law.initial_gain if law.informs_by_itself else gain_kernel.INFORMATION_GAIN
    memory["live"][:2] = law.lambda1, law.holds_at_once
    memory["live"][regression_kernel.IS_STABLE] = 1.0  # theta(0) = 0
    memory["L"][:] = L


def _start_values(name: str, theta: FloatArray, orders: Orders) -> FloatArray:
    own = np.array(theta, dtype=np.float64)
    if own.shape != (orders.n_parameters,) or not np.isfinite(own).all():
        raise BadShape(f"{name}: theta(0) is {theta}, expected {orders.n_parameters} finite numbers: {orders.names}.")
    return own
