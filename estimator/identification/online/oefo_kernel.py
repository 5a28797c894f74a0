"""The compiled loop behind :mod:`estimator.identification.online.oefo`; one code for a block and for one sample.

All state lives in the caller's arrays. F is kept as U D U^T (U unit upper triangular, D diagonal) and updated
after G. J. Bierman, Factorization Methods for Discrete Sequential Estimation (Academic Press, 1977), chapter
V: F can then not lose symmetry or turn indefinite by rounding, however long the run, which the plain update
does.
"""

from __future__ import annotations

import numpy as np

from estimator.compiled import compiled
from estimator.signals.record import BoolArray, FloatArray

# Rows of `past`: newest value first.
Y_HAT = 0
Y_HAT_F = 1  # filtered by 1 / L
INPUT = 2
INPUT_F = 3

# Places in `orders`.
NA, NB, NK, ADAPT_FILTER, START_UP = 0, 1, 2, 3, 4

# Places in `law`, in the order of GainLaw.
INITIAL_GAIN, LAMBDA1, LAMBDA0, TRACE, ALPHA = 0, 1, 2, 3, 4

# Places in `live`.
LAMBDA1_NOW = 0
HOLDS_TRACE = 1  # 1 once tr F has fallen to the trace of the law
USED = 2  # samples that corrected theta
PEAK = 3  # largest output seen
HELD_SAMPLES = 4  # samples until the regressor is free of torques that were held in place of missing ones

# Columns of `out` after theta.
OUT_Y_HAT, OUT_E_PRIOR, OUT_E_POST = 0, 1, 2

# Reasons, as in estimator.identification.online.recursive.Reason.
NONE, TOO_FEW_SAMPLES, NOT_EXCITED, UNSTABLE = 0, 1, 2, 3

SETTLING = 10.0  # good samples per parameter before an estimate is called one
LEARNT = 0.1  # F_ii / F_ii(0) below which parameter i owes less than a tenth to its start value
LARGEST = 1e30  # beyond it a value is no measurement; below it nothing here can overflow (1e308)
RUNAWAY = 1e3  # times the largest output, beyond which a predicted output is given up


@compiled
def push(row: FloatArray, value: float) -> None:
    """Put a value in front; the oldest drops out."""
    for i in range(row.shape[0] - 1, 0, -1):
        row[i] = row[i - 1]
    row[0] = value


@compiled
def dot(a: FloatArray, b: FloatArray) -> float:
    """Return a^T b; a plain loop, since calling a library takes longer than eight products."""
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total


@compiled
def filtered(value: float, L: FloatArray, row: FloatArray) -> float:
    """Return the next output of 1 / L, equation (7), given its last ones."""
    for i in range(1, L.shape[0]):
        value -= L[i] * row[i - 1]
    return value


@compiled
def is_stable(a: FloatArray, work: FloatArray) -> bool:
    """Tell whether 1 + a_1 q^-1 + ... has all roots inside the unit circle (step-down, Schur and Cohn)."""
    n = a.shape[0]
    for i in range(n):
        work[i] = a[i]
    for m in range(n, 0, -1):
        k = work[m - 1]
        if not abs(k) < 1.0:
            return False
        for i in range((m - 1) // 2 + (m - 1) % 2):
            low, high = work[i], work[m - 2 - i]
            work[i] = (low - k * high) / (1.0 - k * k)
            work[m - 2 - i] = (high - k * low) / (1.0 - k * k)
    return True


@compiled
def gain(Phi: FloatArray, U: FloatArray, D: FloatArray, g: FloatArray) -> float:
    """Set g = F Phi and return Phi^T F Phi."""
    n = Phi.shape[0]
    s = 0.0
    for i in range(n):
        g[i] = 0.0
    for j in range(n):
        f = Phi[j]
        for i in range(j):
            f += U[i, j] * Phi[i]
        v = D[j] * f
        s += f * v
        g[j] += v
        for i in range(j):
            g[i] += U[i, j] * v
    return s


@compiled
def downdate(Phi: FloatArray, ratio: float, U: FloatArray, D: FloatArray, work: FloatArray) -> None:
    """Take Phi into the factors: F - F Phi Phi^T F / (ratio + Phi^T F Phi), without forgetting."""
    before = ratio
    for j in range(Phi.shape[0]):
        f = Phi[j]
        for i in range(j):
            f += U[i, j] * Phi[i]
        v = D[j] * f
        after = before + f * v
        D[j] *= before / after
        for i in range(j):
            u_ij = U[i, j]
            U[i, j] = u_ij - work[i] * f / before
            work[i] += u_ij * v
        work[j] = v
        before = after


@compiled
def diagonal(U: FloatArray, D: FloatArray, i: int) -> float:
    """Return F_ii."""
    value = float(D[i])
    for j in range(i + 1, D.shape[0]):
        value += U[i, j] * U[i, j] * D[j]
    return value


@compiled
def trace_of(U: FloatArray, D: FloatArray) -> float:
    """Return tr F."""
    value = 0.0
    for i in range(D.shape[0]):
        value += diagonal(U, D, i)
    return value


@compiled
def learn(Phi: FloatArray, law: FloatArray, live: FloatArray, U: FloatArray, D: FloatArray, work: FloatArray) -> None:
    """Update F by equation (5) with the lambda_1 and lambda_2 of the profile."""
    holds = live[HOLDS_TRACE] == 1.0
    lambda1 = live[LAMBDA1_NOW]
    downdate(Phi, law[ALPHA] if holds else lambda1, U, D, work)
    trace = trace_of(U, D)
    if holds:
        scale = law[TRACE] / trace
    elif trace <= lambda1 * law[INITIAL_GAIN] * D.shape[0]:
        scale = 1.0 / lambda1
    else:
        scale = 1.0  # without excitation nothing is forgotten: F would grow beyond every bound
    for i in range(D.shape[0]):
        D[i] *= scale
    live[LAMBDA1_NOW] = law[LAMBDA0] * lambda1 + 1.0 - law[LAMBDA0]
    if trace * scale <= law[TRACE]:
        live[HOLDS_TRACE] = 1.0


@compiled
def verdict(
    theta: FloatArray, na: int, initial_gain: float, used: float, U: FloatArray, D: FloatArray, stable: bool
) -> int:
    """Return the reason of the estimate's status."""
    if used < SETTLING * theta.shape[0]:
        return TOO_FEW_SAMPLES
    for i in range(theta.shape[0]):
        if not diagonal(U, D, i) < LEARNT * initial_gain:
            return NOT_EXCITED
    return NONE if stable else UNSTABLE


@compiled
def regressor(orders: np.ndarray, outputs: FloatArray, inputs: FloatArray, phi: FloatArray) -> None:
    """Fill phi, equation (3) with the predicted outputs; with the filtered rows of `past` it is Phi."""
    na = orders[NA]
    for i in range(na):
        phi[i] = -outputs[i]
    for j in range(orders[NB]):
        phi[na + j] = inputs[orders[NK] + j]


@compiled
def take_input(u: float, orders: np.ndarray, live: FloatArray, L: FloatArray, past: FloatArray) -> None:
    """Push the input and its filtered value; hold the last one in place of one that can't be used."""
    if abs(u) <= LARGEST:
        live[HELD_SAMPLES] = max(live[HELD_SAMPLES] - 1.0, 0.0)
    else:
        u = past[INPUT, 0]
        live[HELD_SAMPLES] = orders[NK] + orders[NB]
    push(past[INPUT], u)
    push(past[INPUT_F], filtered(u, L, past[INPUT_F]))


@compiled
def oefo_block(
    u: FloatArray,
    y: FloatArray,
    okay: BoolArray,
    orders: np.ndarray,
    law: FloatArray,
    live: FloatArray,
    theta: FloatArray,
    U: FloatArray,
    D: FloatArray,
    L: FloatArray,
    past: FloatArray,
    work: FloatArray,
    out: FloatArray,
    out_used: BoolArray,
    out_reason: np.ndarray,
) -> None:
    """Run the samples of a block through equations (1) to (7).

    ``work`` has shape (4, na+nb): phi, Phi, g and room for the factors. The other shapes are those of
    :class:`estimator.identification.online.oefo.Oefo`.
    """
    n, na = theta.shape[0], orders[NA]
    phi, Phi, g = work[0], work[1], work[2]
    for t in range(u.shape[0]):
        take_input(u[t], orders, live, L, past)
        regressor(orders, past[Y_HAT], past[INPUT], phi)
        if live[USED] < orders[START_UP]:
            Phi[:] = phi
        else:
            regressor(orders, past[Y_HAT_F], past[INPUT_F], Phi)
        y_hat = dot(theta, phi)
        used = okay[t] and abs(y[t]) <= LARGEST and live[HELD_SAMPLES] == 0.0
        e_prior = y[t] - y_hat if used else 0.0
        s = gain(Phi, U, D, g)
        e_post = e_prior / (1.0 + s)  # equation (6)
        if used:
            for i in range(n):
                theta[i] += g[i] * e_post  # equation (4)
            learn(Phi, law, live, U, D, work[3])
            live[USED] += 1.0
            live[PEAK] = max(live[PEAK], abs(y[t]))
            y_hat = dot(theta, phi)
        if not abs(y_hat) <= RUNAWAY * live[PEAK]:
            y_hat = y[t] if used else 0.0
        stable = is_stable(theta[:na], work[3])
        if stable and orders[ADAPT_FILTER] == 1:
            L[1:] = theta[:na]
        push(past[Y_HAT], y_hat)
        push(past[Y_HAT_F], filtered(y_hat, L, past[Y_HAT_F]))
        out[t, :n] = theta
        out[t, n + OUT_Y_HAT] = y_hat
        out[t, n + OUT_E_PRIOR] = e_prior
        out[t, n + OUT_E_POST] = e_post
        out_used[t] = used
        out_reason[t] = verdict(theta, na, law[INITIAL_GAIN], live[USED], U, D, stable)
