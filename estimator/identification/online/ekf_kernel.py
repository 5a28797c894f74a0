"""The compiled loop behind :mod:`estimator.identification.online.ekf`; a single sample is a block of one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimator.compiled import compiled, inlined
from estimator.identification.linear_model import Orders
from estimator.identification.online.gain_kernel import absorb, diagonal
from estimator.identification.online.memory import Parts, Shapes
from estimator.identification.online.regression_kernel import (
    LARGEST,
    LEARNT,
    N_LIVE,
    NONE,
    NOT_EXCITED,
    SETTLING,
    TOO_FEW_SAMPLES,
    USED,
    constant_signal,
    note_output,
    note_torque,
    push,
)
from estimator.identification.online.two_mass_kernel import BY_LOAD, BY_LOG, N_COLUMNS, propagate, transfer_function
from estimator.signals.record import BoolArray, FloatArray

N_STATES = 8  # w_M, w_L, s, T_0, ln J_M, ln J_L, ln k, ln c
N_MOTION = 4
FIRST_LOG = 4

# Places in `law`: numbers, then three rows of N_STATES.
PERIOD, VARIANCE = 0, 1
NOISE = 2  # variance each state gains per sample
START = NOISE + N_STATES  # variance of each state before the first sample
ORIGIN = START + N_STATES  # value of each state before the first sample
N_LAW = ORIGIN + N_STATES

# Places in `live` besides those of all estimators, where theirs have the gain.
STARTED = 0  # 1 once an output has set the speeds
REJECTED = 1  # outputs in a row that the prediction makes impossible

GATE = 100.0  # standard deviations beyond which an output is no measurement
PATIENCE = 20.0  # such outputs in a row after which it is the motion that is wrong
LARGEST_TORQUE = 1e12  # beyond it a torque is no measurement; below it nothing here can overflow
WIDEST = 4.6  # ln 100: how far a parameter may go from where it started

WIDTH = 2 * N_STATES  # W = [Phi U, I]


def kept(of: Orders) -> Shapes:
    """Return the parts the filter keeps; ``inputs`` are the torques on their way, newest first."""
    vectors = dict.fromkeys(("x", "D", "diagonal"), (N_STATES,))
    own = {"theta": (of.n_parameters,), "physical": (6,), "inputs": (of.nk,), "U": (N_STATES, N_STATES)}
    return {"live": (N_LIVE,), **vectors, **own}


def room() -> Shapes:
    """Return the parts it works in: W, its weights, a row of it; three times the motion's columns; three vectors."""
    columns = dict.fromkeys(("columns", "term", "following"), (3, N_COLUMNS))
    vectors = dict.fromkeys(("H", "g", "f"), (N_STATES,))
    return {"W": (N_STATES, WIDTH), "weights": (WIDTH,), "row": (WIDTH,), **columns, **vectors}


@inlined
def begin(y: float, m: Parts) -> None:
    """Set both speeds to an output, and forget how motion and parameters go together."""
    for i in range(N_STATES):
        if i < N_MOTION:
            m.x[i] = y if i < 2 else m.law[ORIGIN + i]
        m.D[i] = m.law[START + i]
        for j in range(N_STATES):
            m.U[i, j] = 1.0 if i == j else 0.0
    m.live[STARTED] = 1.0
    m.live[REJECTED] = 0.0


@inlined
def orthogonalise(W: FloatArray, weights: FloatArray, row: FloatArray, U: FloatArray, D: FloatArray) -> None:
    """Factor W diag(weights) W^T into U D U^T (Thornton's modified weighted Gram-Schmidt)."""
    for j in range(N_STATES - 1, -1, -1):
        total = 0.0
        for m in range(WIDTH):
            row[m] = weights[m] * W[j, m]
            total += row[m] * W[j, m]
        D[j] = total
        for i in range(N_STATES):
            U[j, i] = 1.0 if i == j else 0.0
        for i in range(j):
            product = 0.0
            for m in range(WIDTH):
                product += W[i, m] * row[m]
            share = product / total if total > 0.0 else 0.0
            U[j, i] = share
            for m in range(WIDTH):
                W[i, m] -= share * W[j, m]


@inlined
def spread(m: Parts) -> None:
    """Move the covariance on by one period: Phi P Phi^T + Q."""
    W, U, columns, law = m.W, m.U, m.columns, m.law
    for j in range(N_STATES):  # column j of Phi U, with Phi the unit matrix below its first three rows
        for i in range(N_STATES):
            W[i, j] = U[j, i]
        for i in range(3):
            value = 0.0
            for k in range(3):
                value += columns[i, 1 + k] * U[j, k]
            value += columns[i, BY_LOAD] * U[j, 3]
            for k in range(FIRST_LOG, N_STATES):
                value += columns[i, BY_LOG + k - FIRST_LOG] * U[j, k]
            W[i, j] = value
        m.weights[j] = m.D[j]
    for i in range(N_STATES):
        for j in range(N_STATES):
            W[i, N_STATES + j] = 1.0 if i == j else 0.0
        grows = i < N_MOTION or m.diagonal[i] < law[START + i]  # without excitation a parameter is forgotten, once
        m.weights[N_STATES + i] = law[NOISE + i] if grows else 0.0
    orthogonalise(W, m.weights, m.row, U, m.D)


@inlined
def observed(y: float, m: Parts) -> bool:
    """Correct the state by an output; tell whether it was possible besides the prediction."""
    x, law, live = m.x, m.law, m.live
    variance = 0.0
    for j in range(N_STATES):
        variance += m.U[j, 0] * m.U[j, 0] * m.D[j]
    error = y - x[0]
    if not error * error <= GATE * GATE * (variance + law[VARIANCE]):
        live[REJECTED] += 1.0
        if live[REJECTED] >= PATIENCE:
            begin(y, m)
        return False
    live[REJECTED] = 0.0
    for i in range(N_STATES):
        m.H[i] = 1.0 if i == 0 else 0.0
    s = absorb(m.H, law[VARIANCE], m.U, m.D, m.g, m.f)
    for i in range(N_STATES):
        x[i] += m.g[i] * error / (law[VARIANCE] + s)
    for i in range(FIRST_LOG, N_STATES):
        x[i] = min(max(x[i], law[ORIGIN + i] - WIDEST), law[ORIGIN + i] + WIDEST)
    return True


@inlined
def judged(m: Parts) -> int:
    """Return the reason of the estimate's status."""
    if m.live[USED] < SETTLING * N_STATES:
        return TOO_FEW_SAMPLES
    constant = constant_signal(m.live)
    if constant != NONE:
        return constant
    for i in range(FIRST_LOG, N_STATES):
        if not m.diagonal[i] < LEARNT * m.law[START + i]:
            return NOT_EXCITED
    return NONE


@inlined
def take_torque(u: float, live: FloatArray, inputs: FloatArray) -> None:
    """Push the torque; the last one is held in place of one that can't be used."""
    if abs(u) <= LARGEST_TORQUE:
        note_torque(u, inputs[0], live)
        push(inputs, u)
    else:
        push(inputs, inputs[0])


@inlined
def predict(m: Parts) -> None:
    """Move the state on by one period, and read the transfer function off its derivatives."""
    x, columns = m.x, m.columns
    for i in range(3):
        columns[i, 0] = x[i]
    torque = m.inputs[m.inputs.shape[0] - 1]
    propagate(columns, torque, x[3], m.law[PERIOD], m.physical, m.term, m.following)
    for i in range(3):
        x[i] = columns[i, 0]
    transfer_function(columns, m.theta)


@inlined
def step(u: float, y: float, okay: bool, m: Parts, row: Parts) -> None:
    """Run one sample through correction and prediction."""
    live, x = m.live, m.x
    take_torque(u, live, m.inputs)
    measured = okay and abs(y) <= LARGEST
    if measured and live[STARTED] == 0.0:
        begin(y, m)
    predicted = x[0]
    used = measured and observed(y, m)
    if used:
        note_output(y, live)
    row.y_hat = x[0]
    row.e_prior = y - predicted if used else 0.0
    row.e_post = y - x[0] if used else 0.0
    row.used = used
    for i in range(FIRST_LOG):
        m.physical[i] = np.exp(x[FIRST_LOG + i])
        row.extra[i] = m.physical[i]
    predict(m)
    diagonal(m.U, m.D, m.diagonal)
    row.reason = judged(m)
    if live[STARTED] == 1.0:
        spread(m)
    for i in range(m.theta.shape[0]):
        row.theta[i] = m.theta[i]


@compiled
def block(u: FloatArray, y: FloatArray, okay: BoolArray, memory: NDArray[np.void], out: NDArray[np.void]) -> None:
    """Run the samples of a block through, each into its row of ``out``."""
    for t in range(u.shape[0]):
        step(u[t], y[t], okay[t], memory[0], out[t])
