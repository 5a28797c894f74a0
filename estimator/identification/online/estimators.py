"""The recursive estimators, each as the step that its loop compiles, and the table that they are chosen from.

OEFO, recursive output error with filtered observations, is the paper's algorithm. Recursive least squares, the
instrumental variable method and the output error method with extended prediction model stand below it, each with its
equations. Nevaranta, Montonen, Lindh, "Online Estimation of a Mechanical Driveline Parameters of a Hybrid Bus", EPE'18
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
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from estimator.compiled import compiled, inlined
from estimator.errors import BadModel
from estimator.identification.linear_model import Orders
from estimator.identification.online.adaptation import Adaptation, DecreasingThenConstantTrace, dot
from estimator.identification.online.ekf import Ekf, EkfNoise, TwoMass
from estimator.identification.online.recursive import HELD_OUTPUTS, IS_STABLE, USED, Parts, RecursiveEstimator, Shapes
from estimator.identification.online.regression import (
    ADAPT_FILTER,
    LARGEST,
    START_UP,
    RegressionEstimator,
    corrected,
    fill_row,
    filtered,
    is_stable,
    is_usable,
    kept_in_bounds,
    orders,
    push,
    regressor,
    taken_input,
)
from estimator.signals.record import BoolArray, FloatArray


def oefo_past(of: Orders, n_L: int) -> Shapes:
    """Return its past values: predicted outputs, torques, and both filtered by the n_L coefficients of 1 / L."""
    return {
        "outputs": (of.na,),
        "inputs": (of.nk + of.nb,),
        "outputs_f": (max(of.na, n_L - 1),),
        "inputs_f": (max(of.nk + of.nb, n_L - 1),),
    }


@inlined
def oefo_step(u: float, y: float, okay: bool, m: Parts, row: Parts) -> None:
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
    fill_row(y_hat, e_prior, e_post, used, stable, m, row)


@compiled
def oefo_block(u: FloatArray, y: FloatArray, okay: BoolArray, memory: NDArray[np.void], out: NDArray[np.void]) -> None:
    """Run the samples of a block through, each into its row of ``out``."""
    for t in range(u.shape[0]):
        oefo_step(u[t], y[t], okay[t], memory[0], out[t])


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
            oefo_block,
            oefo_past(orders, np.size(L)),
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


def rls_past(of: Orders) -> Shapes:
    """Return how many past values recursive least squares keeps of each signal."""
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
    fill_row(y_hat, e_prior, e_post, used, is_stable(m.theta, of[0], m.f), m, row)


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
    """Return how many past values the instrumental variable method keeps of each signal; n_L is the filter's length."""
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
    fill_row(simulated, e_prior, e_post, used, stable, m, row)


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
    """Return how many past values the output error method with extended prediction model keeps of each signal."""
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
    fill_row(y_hat, e_prior, e_post, used, is_stable(m.theta, of[0], m.f), m, row)


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


class Feed(Enum):
    """Which samples an estimator is made for."""

    FILTERED = "filtered"  # high-passed and decimated to the models' period
    RAW = "raw"  # as they were recorded, at their own period


@dataclass(frozen=True, slots=True, eq=False)
class Setup:
    """What estimators are made from; each takes what it needs."""

    orders: Orders = field(default_factory=Orders)  # structure of the transfer functions
    sample_time_s: float = 0.02  # period of the samples that will come [s]
    adaptation: Adaptation = field(default_factory=DecreasingThenConstantTrace)  # adaptation-gain profile
    L: FloatArray | None = None  # observation filter's denominator, from a batch model
    start_up_samples: int = 0  # good samples at the start without the filter
    two_mass: TwoMass | None = None  # start values of the physical parameters
    noise: EkfNoise = field(default_factory=EkfNoise)  # for the Kalman filter


@dataclass(frozen=True, slots=True)
class Entry:
    """An estimator that can be asked for by name."""

    title: str  # what it is, for a reader
    make: Callable[[Setup], RecursiveEstimator]  # makes one, ready for samples
    feed: Feed = Feed.FILTERED  # the samples it is made for

    def __call__(self, setup: Setup) -> RecursiveEstimator:
        """Make one, ready for samples."""
        return self.make(setup)


def _oefo(setup: Setup) -> Oefo:
    filtering = Filtering.ADAPTED if setup.L is None else Filtering.FIXED
    L = np.ones(1) if setup.L is None else setup.L
    return Oefo(L, setup.orders, setup.adaptation, filtering, setup.start_up_samples)


def _riv(setup: Setup) -> Riv:
    L = np.ones(1) if setup.L is None else setup.L
    return Riv(L, setup.orders, setup.adaptation, setup.start_up_samples)


def _ekf(setup: Setup) -> Ekf:
    if setup.two_mass is None:
        raise BadModel(
            "ekf: no start values for J_M, J_L, k and c, expected a two-mass model. Give a model file with them; "
            "a factor of two off is near enough."
        )
    return Ekf(setup.two_mass, setup.sample_time_s, setup.orders.nk, setup.noise)


ESTIMATORS: Mapping[str, Entry] = MappingProxyType(
    {
        "oefo": Entry("recursive output error with filtered observations", _oefo),
        "rls": Entry("recursive least squares", lambda setup: Rls(setup.orders, setup.adaptation)),
        "riv": Entry("recursive instrumental variable with auxiliary model", _riv),
        "oeepm": Entry(
            "recursive output error with extended prediction model", lambda setup: OeEpm(setup.orders, setup.adaptation)
        ),
        "ekf": Entry("extended Kalman filter with the two-mass parameters", _ekf, Feed.RAW),
    }
)
"""Every recursive estimator; the paper's first."""
