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
from estimator.identification.offline.starts import complete_rows, stabilised
from estimator.identification.triangular import solve_least_squares, triangular
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
    rows = complete_rows(okay, Orders(PAST, PAST, 1))
    if orders.nk != 1 or orders.nb > n or not 0 < n < FUTURE or np.count_nonzero(rows) < 6 * PAST:
        return None
    y = y - y[okay].mean()
    Z = _past(u - u.mean(), np.where(okay, y, 0.0))
    R = triangular(Z, y, rows=rows)[: Z.shape[1]]
    predictor = np.linalg.lstsq(R[:, :-1], R[:, -1], rcond=None)[0].reshape(PAST, 2)
    ahead = np.zeros((FUTURE, PAST, 2))
    for i in range(FUTURE):
        ahead[i, i:] = predictor[: PAST - i]
    X = Z @ _strongest(R[:, :-1], ahead.reshape(FUTURE, -1).T, n) * np.sqrt(np.count_nonzero(rows))
    C = solve_least_squares(X[rows], y[rows])
    innovation = y - X @ C
    both = rows[:-1] & rows[1:]
    # what acts on the state at row t + 1 is u(t)
    known = np.column_stack([X[:-1], u[:-1] - u.mean(), innovation[:-1]])[both]
    following = np.column_stack([solve_least_squares(known, X[1:, i][both]) for i in range(n)])
    A, B = following[:n].T, following[n : n + 1].T
    b = numerator_of(A, B, C[np.newaxis], 0.0)[1 : orders.nb + 1]
    return stabilised(LinearModel(tuple(np.real(np.poly(A))[1:].tolist()), tuple(b.tolist()), 1, sample_time_s))


def _past(u: FloatArray, y: FloatArray) -> FloatArray:
    """Return the past of every sample, oldest first, zeros before the start: a view, shape (N, 2 PAST)."""
    both = np.zeros((PAST + u.shape[0], 2))
    both[PAST:, 0], both[PAST:, 1] = u, y
    return np.lib.stride_tricks.sliding_window_view(both.ravel(), 2 * PAST)[: 2 * u.shape[0] : 2]


def _strongest(R: FloatArray, ahead: FloatArray, n: int) -> FloatArray:
    """Return the map from the past to the n strongest principal components of predicted outputs, shape (2 PAST, n).

    R is the past's triangle, ``ahead`` its map to the predictions; each component has a square sum of 1.
    """
    _, powers, axes = np.linalg.svd(R @ ahead, full_matrices=False)
    return np.asarray(ahead @ axes[:n].T / powers[:n], dtype=np.float64)
