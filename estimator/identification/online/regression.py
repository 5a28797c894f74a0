"""Regression along an adaptation gain: what OEFO, RLS, RIV and OEEPM share, compiled and around it."""

from __future__ import annotations

import numpy as np

from estimator.compiled import inlined
from estimator.errors import BadModel, BadShape
from estimator.identification.linear_model import Orders
from estimator.identification.online.adaptation import (
    HOLDS_AT_ONCE,
    INFORMATION_GAIN,
    INITIAL_GAIN,
    LAMBDA2,
    Adaptation,
    DecreasingThenConstantTrace,
    GainLaw,
    adapt,
    dot,
    informs_by_itself,
)
from estimator.identification.online.recursive import (
    BEGUN,
    CONSTANT_OUTPUT,
    HELD_SAMPLES,
    IS_STABLE,
    LAST_OUTPUT,
    N_LIVE,
    NONE,
    NOT_EXCITED,
    OUTPUT_MOVES,
    PEAK,
    TOO_FEW_SAMPLES,
    TORQUE_MOVES,
    UNSTABLE,
    USED,
    Block,
    Memory,
    Parts,
    RecursiveEstimator,
    Shapes,
)
from estimator.signals.record import FloatArray
from estimator.signals.settings import Requirement, require

# Places in `structure` after the orders, which the shapes tell already.
NA, NB, NK, ADAPT_FILTER, START_UP = range(5)

SETTLING = 10.0  # good samples per parameter before an estimate is called one
LEARNT = 0.1  # F_ii / F_ii(0) below which parameter i owes less than a tenth to its start value
LARGEST = 1e30  # beyond it a value is no measurement; below it nothing here can overflow (1e308)
RUNAWAY = 1e3  # times the largest output, beyond which a predicted output is given up


def memory_parts(n: int) -> Shapes:
    """Return the parts that every estimator of n parameters keeps, next to its past values and L."""
    vectors = dict.fromkeys(("theta", "D", "known_D", "diagonal"), (n,))
    return {"live": (N_LIVE,), **vectors, "U": (n, n), "known_U": (n, n)}


def room(n: int) -> Shapes:
    """Return the parts that an estimator of n parameters works in: both regressors, F Phi and U^T Phi."""
    return dict.fromkeys(("phi", "Phi", "g", "f"), (n,))


@inlined
def orders(m: Parts, row: Parts) -> tuple[int, int, int]:
    """Return na, nb and nk, as the shapes tell them: constants to the compiler."""
    na = m.outputs.shape[0]
    nb = row.theta.shape[0] - na
    return na, nb, m.inputs.shape[0] - nb


@inlined
def push(past: FloatArray, value: float) -> None:
    """Put a value in front of past ones, newest first; the oldest drops out."""
    if past.shape[0] > 0:
        for i in range(past.shape[0] - 1, 0, -1):
            past[i] = past[i - 1]
        past[0] = value


@inlined
def filtered(value: float, L: FloatArray, past: FloatArray) -> float:
    """Return the next output of 1 / L, equation (7), given its last ones."""
    for i in range(1, L.shape[0]):
        value -= L[i] * past[i - 1]
    return value


@inlined
def is_stable(a: FloatArray, n: int, work: FloatArray) -> bool:
    """Tell whether 1 + a_1 q^-1 + .. + a_n q^-n has all roots inside the unit circle (step-down, Schur and Cohn)."""
    for i in range(n):
        work[i] = a[i]
    for m in range(n, 0, -1):
        k = work[m - 1]
        if not abs(k) < 1.0:
            return False
        weight = 1.0 / (1.0 - k * k)
        for i in range(m // 2):
            low, high = work[i], work[m - 2 - i]
            work[i] = (low - k * high) * weight
            work[m - 2 - i] = (high - k * low) * weight
    return True


@inlined
def regressor(of: tuple[int, int, int], outputs: FloatArray, inputs: FloatArray, phi: FloatArray) -> None:
    """Fill phi, equation (3), with outputs and inputs of whatever kind (measured, predicted, filtered)."""
    na, nb, nk = of
    for i in range(na):
        phi[i] = -outputs[i]
    for j in range(nb):
        phi[na + j] = inputs[nk + j]


@inlined
def note_torque(u: float, before: float, live: FloatArray) -> None:
    """Remember whether the torque ever changes."""
    if live[BEGUN] == 1.0 and u != before:
        live[TORQUE_MOVES] = 1.0
    live[BEGUN] = 1.0


@inlined
def note_output(y: float, live: FloatArray) -> None:
    """Count an output that was used, and remember whether it ever changes."""
    if live[USED] > 0.0 and y != live[LAST_OUTPUT]:
        live[OUTPUT_MOVES] = 1.0
    live[LAST_OUTPUT] = y
    live[USED] += 1.0


@inlined
def constant_signal(live: FloatArray) -> int:
    """Return the reason that a signal which never changes gives, or none."""
    if live[TORQUE_MOVES] == 0.0:
        return NOT_EXCITED
    return NONE if live[OUTPUT_MOVES] == 1.0 else CONSTANT_OUTPUT


@inlined
def taken_input(u: float, m: Parts) -> float:
    """Push the input and return it; the last one is held in place of one that can't be used."""
    live, inputs = m.live, m.inputs
    if abs(u) <= LARGEST:
        note_torque(u, inputs[0], live)
        live[HELD_SAMPLES] = max(live[HELD_SAMPLES] - 1.0, 0.0)
    else:
        u = inputs[0]
        live[HELD_SAMPLES] = inputs.shape[0]
    push(inputs, u)
    return u


@inlined
def is_usable(y: float, okay: bool, live: FloatArray) -> bool:
    """Tell whether theta may be corrected by this output."""
    return okay and abs(y) <= LARGEST and live[HELD_SAMPLES] == 0.0


@inlined
def kept_in_bounds(y_hat: float, y: float, used: bool, live: FloatArray) -> float:
    """Return the prediction, or the measured output (without one: 0) in place of one that has run away."""
    if abs(y_hat) <= RUNAWAY * live[PEAK]:
        return y_hat
    return y if used else 0.0


@inlined
def corrected(output: float, y: float, used: bool, Phi: FloatArray, m: Parts) -> tuple[float, float, float]:
    """Correct theta and F by an output that may be used, equations (1) and (4) to (6).

    Return the prediction with the parameters after it, and the errors before and after; ``output`` is y, or y filtered.
    """
    predicted = dot(m.theta, m.phi)
    e_prior, e_post = 0.0, 0.0
    if used:
        e_prior = output - predicted
        s = adapt(Phi, m)
        e_post = e_prior / (1.0 + s)  # equation (6)
        for i in range(m.theta.shape[0]):
            m.theta[i] += m.g[i] * e_post  # equation (4)
        note_output(y, m.live)
        m.live[PEAK] = max(m.live[PEAK], abs(y))
        predicted = dot(m.theta, m.phi)
    return predicted, e_prior, e_post


@inlined
def verdict(stable: bool, m: Parts, row: Parts) -> int:
    """Return the reason of the estimate's status; only the parameters of the transfer function are judged."""
    if m.live[USED] < SETTLING * m.theta.shape[0]:
        return TOO_FEW_SAMPLES
    constant = constant_signal(m.live)
    if constant != NONE:
        return constant
    start = m.law[INITIAL_GAIN] if informs_by_itself(m.law) else INFORMATION_GAIN
    for i in range(row.theta.shape[0]):
        if not m.diagonal[i] < LEARNT * start:
            return NOT_EXCITED
    return NONE if stable else UNSTABLE


@inlined
def fill_row(y_hat: float, e_prior: float, e_post: float, used: bool, stable: bool, m: Parts, row: Parts) -> None:
    """Write the estimate after one sample into a row of the trajectory."""
    n = row.theta.shape[0]
    for i in range(n):
        row.theta[i] = m.theta[i]
    for i in range(row.extra.shape[0]):
        row.extra[i] = m.theta[n + i]
    row.y_hat = y_hat
    row.e_prior = e_prior
    row.e_post = e_post
    row.used = used
    row.reason = verdict(stable, m, row)


class RegressionEstimator(RecursiveEstimator):
    """An estimator that corrects theta along F Phi; what differs is what stands in phi and Phi."""

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
        shapes = {**memory_parts(n), "L": own_L.shape, **past}
        memory = Memory(shapes, {"structure": structure, "law": law.as_array(n)}, room(n))
        _begin(memory, own_L, law)
        if theta is not None:
            memory["theta"][: orders.n_parameters] = _start_values(name, theta, orders)
        super().__init__(name, block, orders, memory, extra_names)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the parameters the samples so far do not determine."""
        if self._stands_still:
            return self._orders.names
        start = INFORMATION_GAIN if self._judged_separately else self._memory["law"][INITIAL_GAIN]
        still = self._memory["diagonal"] >= LEARNT * start
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
    def _judged_separately(self) -> bool:
        law = self._memory["law"]
        return bool(law[LAMBDA2] == 0.0 or law[HOLDS_AT_ONCE] == 1.0)


def checked_filter(name: str, L: FloatArray) -> FloatArray:
    """Return a filter's coefficients 1, l_1 ...; BadModel if not finite or a root is not inside the unit circle."""
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
    memory["D"][:], memory["known_D"][:] = law.initial_gain, INFORMATION_GAIN
    memory["diagonal"][:] = law.initial_gain if law.informs_by_itself else INFORMATION_GAIN
    memory["live"][:2] = law.lambda1, law.holds_at_once
    memory["live"][IS_STABLE] = 1.0  # theta(0) = 0
    memory["L"][:] = L


def _start_values(name: str, theta: FloatArray, orders: Orders) -> FloatArray:
    own = np.array(theta, dtype=np.float64)
    if own.shape != (orders.n_parameters,) or not np.isfinite(own).all():
        raise BadShape(f"{name}: theta(0) is {theta}, expected {orders.n_parameters} finite numbers: {orders.names}.")
    return own
