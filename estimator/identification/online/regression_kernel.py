"""Compiled: what the estimators of a transfer function share: their memory, their signals, their corrections.

All state lives in one record ``m`` (:mod:`estimator.identification.online.memory`) with the parts of :func:`kept`,
:func:`room` and each estimator's own. A step takes one sample and fills a row of results
(:func:`estimator.identification.online.kernel_estimator.row_type`); the same step serves a block and the rig's single
sample.
"""

from __future__ import annotations

from estimator.compiled import inlined
from estimator.identification.online.gain_kernel import INFORMATION_GAIN, INITIAL_GAIN, adapt, informs_by_itself
from estimator.identification.online.memory import Parts, Shapes
from estimator.signals.record import FloatArray

# Places in `structure` after the orders, which the shapes tell already.
NA, NB, NK, ADAPT_FILTER, START_UP = range(5)

# Places in `live` after those of the gain.
USED = 2  # samples that corrected theta
PEAK = 3  # largest output seen
HELD_SAMPLES = 4  # samples until the regressor is free of torques that were held in place of missing ones
HELD_OUTPUTS = 5  # the same of outputs
IS_STABLE = 6  # 1 while A_hat is stable
BEGUN = 7  # 1 after the first torque
TORQUE_MOVES = 8  # 1 once the torque has changed
OUTPUT_MOVES = 9  # 1 once the output has
LAST_OUTPUT = 10
N_LIVE = 11

# Reasons, as in estimator.identification.online.recursive.Reason.
NONE, TOO_FEW_SAMPLES, NOT_EXCITED, UNSTABLE, CONSTANT_OUTPUT = range(5)

SETTLING = 10.0  # good samples per parameter before an estimate is called one
LEARNT = 0.1  # F_ii / F_ii(0) below which parameter i owes less than a tenth to its start value
LARGEST = 1e30  # beyond it a value is no measurement; below it nothing here can overflow (1e308)
RUNAWAY = 1e3  # times the largest output, beyond which a predicted output is given up


def kept(n: int) -> Shapes:
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
def correct(error: float, y: float, Phi: FloatArray, m: Parts) -> float:
    """Correct theta and F by an a-priori error, equations (4) to (6); return the a-posteriori error."""
    s = adapt(Phi, m)
    e_post = error / (1.0 + s)  # equation (6)
    for i in range(m.theta.shape[0]):
        m.theta[i] += m.g[i] * e_post  # equation (4)
    note_output(y, m.live)
    m.live[PEAK] = max(m.live[PEAK], abs(y))
    return e_post


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
def tell(y_hat: float, e_prior: float, e_post: float, used: bool, stable: bool, m: Parts, row: Parts) -> None:
    """Fill the row of results of a sample."""
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
