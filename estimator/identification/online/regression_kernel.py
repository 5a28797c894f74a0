"""Compiled: what the estimators of a transfer function share: their memory, their signals, their corrections.

All state lives in one vector (:mod:`estimator.identification.online.memory`); :func:`opened` gives the parts of it
in the order of ``PARTS``. A step takes one sample, and the same step serves a block and the rig's single sample.
"""

from __future__ import annotations

import numpy as np

from estimator.compiled import borrowing, inlined
from estimator.identification.online.gain_kernel import INFORMATION_GAIN, INITIAL_GAIN, adapt, informs_by_itself
from estimator.signals.record import FloatArray

PARTS = ("live", "theta", "U", "D", "known_U", "known_D", "diagonal", "work", "filter", "past")
"""Parts of the memory, in the order in which :func:`opened` gives them."""

# Places in `structure`.
NA, NB, NK, ADAPT_FILTER, START_UP, N, DEPTH = range(7)

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

N_OUT = 5  # columns of `out` after the parameters, see :func:`tell`

# Reasons, as in estimator.identification.online.recursive.Reason.
NONE, TOO_FEW_SAMPLES, NOT_EXCITED, UNSTABLE, CONSTANT_OUTPUT = range(5)

SETTLING = 10.0  # good samples per parameter before an estimate is called one
LEARNT = 0.1  # F_ii / F_ii(0) below which parameter i owes less than a tenth to its start value
LARGEST = 1e30  # beyond it a value is no measurement; below it nothing here can overflow (1e308)
RUNAWAY = 1e3  # times the largest output, beyond which a predicted output is given up


@inlined
def opened(memory: FloatArray, at: np.ndarray, structure: np.ndarray) -> tuple[FloatArray, ...]:
    """Return the parts of a memory that every estimator has; vectors of length n, but U and known_U (n, n)."""
    n = structure[N]
    return (
        memory[at[0] : at[1]],
        memory[at[1] : at[2]],
        memory[at[2] : at[3]].reshape((n, n)),
        memory[at[3] : at[4]],
        memory[at[4] : at[5]].reshape((n, n)),
        memory[at[5] : at[6]],
        memory[at[6] : at[7]],
        memory[at[7] : at[7] + n],
        memory[at[7] + n : at[7] + 2 * n],
        memory[at[7] + 2 * n : at[7] + 3 * n],
        memory[at[7] + 3 * n : at[8]],
    )


@inlined
def past(memory: FloatArray, at: np.ndarray, structure: np.ndarray, row: int) -> FloatArray:
    """Return a row of past values, newest first."""
    start = at[9] + row * structure[DEPTH]
    return memory[start : start + structure[DEPTH]]


@borrowing
def push(row: FloatArray, value: float) -> None:
    """Put a value in front; the oldest drops out."""
    for i in range(row.shape[0] - 1, 0, -1):
        row[i] = row[i - 1]
    row[0] = value


@borrowing
def filtered(value: float, L: FloatArray, row: FloatArray) -> float:
    """Return the next output of 1 / L, equation (7), given its last ones."""
    for i in range(1, L.shape[0]):
        value -= L[i] * row[i - 1]
    return value


@borrowing
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


@borrowing
def regressor(structure: np.ndarray, outputs: FloatArray, inputs: FloatArray, phi: FloatArray) -> None:
    """Fill phi, equation (3), with outputs and inputs of whatever kind (measured, predicted, filtered)."""
    na, nk = structure[NA], structure[NK]
    for i in range(na):
        phi[i] = -outputs[i]
    for j in range(structure[NB]):
        phi[na + j] = inputs[nk + j]


@borrowing
def note_torque(u: float, before: float, live: FloatArray) -> None:
    """Remember whether the torque ever changes."""
    if live[BEGUN] == 1.0 and u != before:
        live[TORQUE_MOVES] = 1.0
    live[BEGUN] = 1.0


@borrowing
def note_output(y: float, live: FloatArray) -> None:
    """Count an output that was used, and remember whether it ever changes."""
    if live[USED] > 0.0 and y != live[LAST_OUTPUT]:
        live[OUTPUT_MOVES] = 1.0
    live[LAST_OUTPUT] = y
    live[USED] += 1.0


@borrowing
def constant_signal(live: FloatArray) -> int:
    """Return the reason that a signal which never changes gives, or none."""
    if live[TORQUE_MOVES] == 0.0:
        return NOT_EXCITED
    return NONE if live[OUTPUT_MOVES] == 1.0 else CONSTANT_OUTPUT


@borrowing
def taken_input(u: float, structure: np.ndarray, live: FloatArray, inputs: FloatArray) -> float:
    """Push the input and return it; the last one is held in place of one that can't be used."""
    if abs(u) <= LARGEST:
        note_torque(u, inputs[0], live)
        live[HELD_SAMPLES] = max(live[HELD_SAMPLES] - 1.0, 0.0)
    else:
        u = inputs[0]
        live[HELD_SAMPLES] = structure[NK] + structure[NB]
    push(inputs, u)
    return u


@borrowing
def is_usable(y: float, okay: bool, live: FloatArray) -> bool:
    """Tell whether theta may be corrected by this output."""
    return okay and abs(y) <= LARGEST and live[HELD_SAMPLES] == 0.0


@borrowing
def kept_in_bounds(y_hat: float, y: float, used: bool, live: FloatArray) -> float:
    """Return the prediction, or the measured output (without one: 0) in place of one that has run away."""
    if abs(y_hat) <= RUNAWAY * live[PEAK]:
        return y_hat
    return y if used else 0.0


@borrowing
def correct(
    error: float,
    y: float,
    Phi: FloatArray,
    law: FloatArray,
    live: FloatArray,
    theta: FloatArray,
    U: FloatArray,
    D: FloatArray,
    known_U: FloatArray,
    known_D: FloatArray,
    diag: FloatArray,
    g: FloatArray,
    f: FloatArray,
) -> float:
    """Correct theta and F by an a-priori error, equations (4) to (6); return the a-posteriori error."""
    s = adapt(Phi, law, live, U, D, known_U, known_D, diag, g, f)
    e_post = error / (1.0 + s)  # equation (6)
    for i in range(theta.shape[0]):
        theta[i] += g[i] * e_post  # equation (4)
    note_output(y, live)
    live[PEAK] = max(live[PEAK], abs(y))
    return e_post


@borrowing
def verdict(structure: np.ndarray, law: FloatArray, live: FloatArray, diag: FloatArray, stable: bool) -> int:
    """Return the reason of the estimate's status; only the parameters of the transfer function are judged."""
    if live[USED] < SETTLING * structure[N]:
        return TOO_FEW_SAMPLES
    constant = constant_signal(live)
    if constant != NONE:
        return constant
    start = law[INITIAL_GAIN] if informs_by_itself(law) else INFORMATION_GAIN
    for i in range(structure[NA] + structure[NB]):
        if not diag[i] < LEARNT * start:
            return NOT_EXCITED
    return NONE if stable else UNSTABLE


@borrowing
def tell(
    theta: FloatArray, y_hat: float, e_prior: float, e_post: float, used: bool, reason: float, t: int, out: FloatArray
) -> None:
    """Fill the row of results of sample t."""
    n = theta.shape[0]
    for i in range(n):
        out[t, i] = theta[i]
    out[t, n] = y_hat
    out[t, n + 1] = e_prior
    out[t, n + 2] = e_post
    out[t, n + 3] = 1.0 if used else 0.0
    out[t, n + 4] = reason
