"""The compiled loop behind :mod:`estimator.identification.online.ekf`; a single sample is a block of one."""

from __future__ import annotations

import numpy as np

from estimator.compiled import borrowing, compiled, inlined
from estimator.identification.online.gain_kernel import absorb, diagonal
from estimator.identification.online.regression_kernel import (
    LARGEST,
    LEARNT,
    NK,
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

PARTS = ("live", "theta", "x", "U", "D", "diagonal", "physical", "past", "work")
"""Parts of the memory, in the order in which :func:`opened` gives them."""

N_STATES = 8  # w_M, w_L, s, T_0, ln J_M, ln J_L, ln k, ln c
N_MOTION = 4
FIRST_LOG = 4

# Places in `law`: numbers, then three rows of N_STATES.
PERIOD, VARIANCE = 0, 1
NOISE = 2  # variance each state gains per sample
START = NOISE + N_STATES  # variance of each state before the first sample
ORIGIN = START + N_STATES  # value of each state before the first sample
N_LAW = ORIGIN + N_STATES

# Places in `live` beside those of all estimators, where theirs have the gain.
STARTED = 0  # 1 once an output has set the speeds
REJECTED = 1  # outputs in a row that the prediction makes impossible

GATE = 100.0  # standard deviations beyond which an output is no measurement
PATIENCE = 20.0  # such outputs in a row after which it is the motion that is wrong
LARGEST_TORQUE = 1e12  # beyond it a torque is no measurement; below it nothing here can overflow
WIDEST = 4.6  # ln 100: how far a parameter may go from where it started

# Room in `work`.
WIDTH = 2 * N_STATES  # W = [Phi U, I]
N_WORK = N_STATES * WIDTH + 2 * WIDTH + 3 * 3 * N_COLUMNS + 3 * N_STATES


@inlined
def opened(memory: FloatArray, at: np.ndarray) -> tuple[FloatArray, ...]:
    """Return the parts of a memory but the last."""
    return (
        memory[at[0] : at[1]],
        memory[at[1] : at[2]],
        memory[at[2] : at[3]],
        memory[at[3] : at[4]].reshape((N_STATES, N_STATES)),
        memory[at[4] : at[5]],
        memory[at[5] : at[6]],
        memory[at[6] : at[7]],
        memory[at[7] : at[8]],
    )


@inlined
def opened_room(memory: FloatArray, at: np.ndarray) -> tuple[FloatArray, ...]:
    """Return the room to work in: W, its weights, a row of it, three times the motion's columns, three vectors."""
    weights = at[8] + N_STATES * WIDTH
    columns = weights + 2 * WIDTH
    size = 3 * N_COLUMNS
    rest = columns + 3 * size
    return (
        memory[at[8] : weights].reshape((N_STATES, WIDTH)),
        memory[weights : weights + WIDTH],
        memory[weights + WIDTH : columns],
        memory[columns : columns + size].reshape((3, N_COLUMNS)),
        memory[columns + size : columns + 2 * size].reshape((3, N_COLUMNS)),
        memory[columns + 2 * size : rest].reshape((3, N_COLUMNS)),
        memory[rest : rest + N_STATES],
        memory[rest + N_STATES : rest + 2 * N_STATES],
        memory[rest + 2 * N_STATES : rest + 3 * N_STATES],
    )


@borrowing
def begin(y: float, law: FloatArray, live: FloatArray, x: FloatArray, U: FloatArray, D: FloatArray) -> None:
    """Set both speeds to an output, and forget how motion and parameters go together."""
    for i in range(N_STATES):
        if i < N_MOTION:
            x[i] = y if i < 2 else law[ORIGIN + i]
        D[i] = law[START + i]
        for j in range(N_STATES):
            U[i, j] = 1.0 if i == j else 0.0
    live[STARTED] = 1.0
    live[REJECTED] = 0.0


@borrowing
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


@borrowing
def spread(
    columns: FloatArray,
    law: FloatArray,
    diag: FloatArray,
    U: FloatArray,
    D: FloatArray,
    W: FloatArray,
    weights: FloatArray,
    row: FloatArray,
) -> None:
    """Move the covariance on by one period: Phi P Phi^T + Q."""
    for j in range(N_STATES):  # column j of Phi U, with Phi the unit matrix below its first three rows
        for i in range(N_STATES):
            W[i, j] = U[j, i]
        for i in range(3):
            value = 0.0
            for m in range(3):
                value += columns[i, 1 + m] * U[j, m]
            value += columns[i, BY_LOAD] * U[j, 3]
            for m in range(FIRST_LOG, N_STATES):
                value += columns[i, BY_LOG + m - FIRST_LOG] * U[j, m]
            W[i, j] = value
        weights[j] = D[j]
    for i in range(N_STATES):
        for j in range(N_STATES):
            W[i, N_STATES + j] = 1.0 if i == j else 0.0
        grows = i < N_MOTION or diag[i] < law[START + i]  # without excitation a parameter is forgotten, once
        weights[N_STATES + i] = law[NOISE + i] if grows else 0.0
    orthogonalise(W, weights, row, U, D)


@borrowing
def observed(
    y: float,
    law: FloatArray,
    live: FloatArray,
    x: FloatArray,
    U: FloatArray,
    D: FloatArray,
    H: FloatArray,
    g: FloatArray,
    f: FloatArray,
) -> bool:
    """Correct the state by an output; tell whether it was possible beside the prediction."""
    variance = 0.0
    for j in range(N_STATES):
        variance += U[j, 0] * U[j, 0] * D[j]
    error = y - x[0]
    if not error * error <= GATE * GATE * (variance + law[VARIANCE]):
        live[REJECTED] += 1.0
        if live[REJECTED] >= PATIENCE:
            begin(y, law, live, x, U, D)
        return False
    live[REJECTED] = 0.0
    for i in range(N_STATES):
        H[i] = 1.0 if i == 0 else 0.0
    s = absorb(H, law[VARIANCE], U, D, g, f)
    for i in range(N_STATES):
        x[i] += g[i] * error / (law[VARIANCE] + s)
    for i in range(FIRST_LOG, N_STATES):
        x[i] = min(max(x[i], law[ORIGIN + i] - WIDEST), law[ORIGIN + i] + WIDEST)
    return True


@borrowing
def judged(law: FloatArray, live: FloatArray, diag: FloatArray) -> int:
    """Return the reason of the estimate's status."""
    if live[USED] < SETTLING * N_STATES:
        return TOO_FEW_SAMPLES
    constant = constant_signal(live)
    if constant != NONE:
        return constant
    for i in range(FIRST_LOG, N_STATES):
        if not diag[i] < LEARNT * law[START + i]:
            return NOT_EXCITED
    return NONE


@borrowing
def take_torque(u: float, live: FloatArray, inputs: FloatArray) -> None:
    """Push the torque; the last one is held in place of one that can't be used."""
    if abs(u) <= LARGEST_TORQUE:
        note_torque(u, inputs[0], live)
        push(inputs, u)
    else:
        push(inputs, inputs[0])


@borrowing
def step(
    u: float,
    y: float,
    okay: bool,
    structure: np.ndarray,
    law: FloatArray,
    live: FloatArray,
    theta: FloatArray,
    x: FloatArray,
    U: FloatArray,
    D: FloatArray,
    diag: FloatArray,
    physical: FloatArray,
    inputs: FloatArray,
    W: FloatArray,
    weights: FloatArray,
    row: FloatArray,
    columns: FloatArray,
    term: FloatArray,
    following: FloatArray,
    H: FloatArray,
    g: FloatArray,
    f: FloatArray,
    t: int,
    out: FloatArray,
) -> None:
    """Run one sample through correction and prediction."""
    take_torque(u, live, inputs)
    measured = okay and abs(y) <= LARGEST
    if measured and live[STARTED] == 0.0:
        begin(y, law, live, x, U, D)
    predicted = x[0]
    used = measured and observed(y, law, live, x, U, D, H, g, f)
    if used:
        note_output(y, live)
    n = theta.shape[0] + FIRST_LOG
    out[t, n] = x[0]
    out[t, n + 1] = y - predicted if used else 0.0
    out[t, n + 2] = y - x[0] if used else 0.0
    out[t, n + 3] = 1.0 if used else 0.0
    for i in range(FIRST_LOG):
        physical[i] = np.exp(x[FIRST_LOG + i])
    for i in range(3):
        columns[i, 0] = x[i]
    propagate(columns, inputs[structure[NK] - 1], x[3], law[PERIOD], physical, term, following)
    for i in range(3):
        x[i] = columns[i, 0]
    transfer_function(columns, theta)
    diagonal(U, D, diag)
    out[t, n + 4] = judged(law, live, diag)
    if live[STARTED] == 1.0:
        spread(columns, law, diag, U, D, W, weights, row)
    for i in range(theta.shape[0]):
        out[t, i] = theta[i]
    for i in range(FIRST_LOG):
        out[t, theta.shape[0] + i] = physical[i]


@compiled
def block(
    u: FloatArray,
    y: FloatArray,
    okay: BoolArray,
    structure: np.ndarray,
    law: FloatArray,
    memory: FloatArray,
    at: np.ndarray,
    out: FloatArray,
) -> None:
    """Run the samples of a block through, each into its row of ``out``."""
    live, theta, x, U, D, diag, physical, inputs = opened(memory, at)
    W, weights, row, columns, term, following, H, g, f = opened_room(memory, at)
    for t in range(u.shape[0]):
        step(
            u[t],
            y[t],
            okay[t],
            structure,
            law,
            live,
            theta,
            x,
            U,
            D,
            diag,
            physical,
            inputs,
            W,
            weights,
            row,
            columns,
            term,
            following,
            H,
            g,
            f,
            t,
            out,
        )
