"""A start by predictor-based subspace identification: no minimum to miss, no bias by coloured noise or feedback.

A long autoregression with input predicts y from the past ``z = [u, y]`` (p samples of each)::

    y(t) = sum_i C Abar^(i-1) [Bbar, K] z(t-i) + e(t)

whatever the noise and whether or not u follows y. Its coefficients, shifted, give the prediction of the next f outputs
as a linear map of the past; the n strongest directions of it are the state (A. Chiuso, Automatica 43, 2007; the
closed-loop relative of N4SID). A, B, C then follow by least squares.
"""

from __future__ import annotations

import numpy as np

from estimator.identification.linear_model import LinearModel, Orders
from estimator.identification.modes.continuous import numerator_of
from estimator.identification.offline.starts import complete_rows, delayed, stabilised
from estimator.identification.triangular import solve_least_squares
from estimator.signals.record import BoolArray, FloatArray

PAST = 40
"""Samples of the past: longer than the impulse response of the predictor, which the noise ends."""

FUTURE = 15
"""Predicted outputs that the state is found from: several times the order."""


def subspace(u: FloatArray, y: FloatArray, okay: BoolArray, orders: Orders, sample_time_s: float) -> LinearModel | None:
    """Return the model of order na, made stable; None if too few unbroken stretches are left of the mask.

    Parameters
    ----------
    u, y, okay : ndarray, shape (N,)
        Input, output, mask.
    orders : Orders
        Only ``nk = 1, nb <= na`` can be had this way: the state starts with the sample before.
    sample_time_s : float
        Sampling period [s].
    """
    n = orders.na
    past = [delayed(x, i) for i in range(1, PAST + 1) for x in (u - u.mean(), np.where(okay, y - y[okay].mean(), 0.0))]
    rows = complete_rows(okay, Orders(PAST, PAST, 1))
    if orders.nk != 1 or orders.nb > n or not 0 < n < FUTURE or np.count_nonzero(rows) < 3 * len(past):
        return None
    Z = np.column_stack(past)
    u, y = past[0], y - y[okay].mean()
    predictor = solve_least_squares(Z[rows], y[rows]).reshape(PAST, 2)
    ahead = np.zeros((FUTURE, PAST, 2))
    for i in range(FUTURE):
        ahead[i, : PAST - i] = predictor[i:]
    X = _strongest(Z @ ahead.reshape(FUTURE, -1).T, rows, n)
    C = solve_least_squares(X[rows], y[rows])
    innovation = y - X @ C
    both = rows[:-1] & rows[1:]
    # past[0] is u one sample ago: what acts on the state at row t + 1 is u(t)
    known = np.column_stack([X[:-1], u[1:], innovation[:-1]])[both]
    following = np.column_stack([solve_least_squares(known, X[1:, i][both]) for i in range(n)])
    A, B = following[:n].T, following[n : n + 1].T
    b = numerator_of(A, B, C[np.newaxis], 0.0)[1 : orders.nb + 1]
    return stabilised(LinearModel(tuple(np.real(np.poly(A))[1:].tolist()), tuple(b.tolist()), 1, sample_time_s))


def _strongest(predicted: FloatArray, rows: BoolArray, n: int) -> FloatArray:
    """Return the n strongest principal components of predicted outputs, shape (N, n), each of unit power."""
    _, axes = np.linalg.eigh(predicted[rows].T @ predicted[rows])
    state = predicted @ axes[:, ::-1][:, :n]
    return np.asarray(state / np.sqrt(np.mean(state[rows] ** 2, axis=0)), dtype=np.float64)
