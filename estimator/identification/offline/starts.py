"""Start values of the off-line fits, whose cost has more than one minimum.

Least squares on the equation error (ARX) needs no start but is biased by noise on y. The iteration of K. Steiglitz and
L. E. McBride (IEEE Trans. Automatic Control 10, 1965) filters u and y by the last 1 / A_hat and repeats it; it is
started from the ARX model itself, and from the simulated output of an ARX model of high order, in which the noise is
averaged out.

Predictor-based subspace identification has no minimum to miss and no bias by coloured noise or feedback: a long
autoregression with input predicts y from the past; its coefficients, shifted, give the next outputs as a linear map of
the past, whose n strongest directions are the state (A. Chiuso, Automatica 43, 2007). A, B, C follow by least squares.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.signal import lfilter

from estimator.identification.linear_model import LinearModel, Orders, solve_least_squares, triangular
from estimator.identification.modes.reduced import numerator_of
from estimator.signals.record import BoolArray, FloatArray

ITERATIONS = 20
HIGH_ORDER = 16  # order of the averaging ARX model: four times the paper's order

LARGEST_RADIUS = 0.999
"""Radius to which a pole on or outside the unit circle is brought; its time constant is then 1000 samples."""

PAST = 40  # samples of the past: longer than the impulse response of the predictor, which the noise ends
FUTURE = 15  # predicted outputs that the state is found from: several times the order


def stabilised(model: LinearModel) -> LinearModel:
    """Reflect poles outside the unit circle into it (same magnitude response but for a factor)."""
    poles = model.poles
    radius = np.abs(poles)
    if (radius < 1.0).all():
        return model
    inside = np.where(radius < 1.0, radius, np.minimum(1.0 / np.maximum(radius, 1.0), LARGEST_RADIUS))
    moved = np.real(np.poly(poles * inside / np.maximum(radius, np.finfo(np.float64).tiny)))
    return LinearModel(tuple(moved[1:].tolist()), model.b, model.nk, model.sample_time_s)


def delayed(x: FloatArray, delay: int) -> FloatArray:
    """Return x delayed by a number of samples, zeros before the start, shape (N,)."""
    out = np.zeros_like(x)
    out[delay:] = x[: x.shape[0] - delay]
    return out


def regressor(u: FloatArray, y: FloatArray, orders: Orders) -> FloatArray:
    """Return ``[-y(t-1) .. -y(t-na), u(t-nk) .. u(t-nk-nb+1)]`` for every t, shape (N, na+nb)."""
    columns = [-delayed(y, i) for i in range(1, orders.na + 1)]
    columns += [delayed(u, orders.nk + j) for j in range(orders.nb)]
    return np.column_stack(columns)


def complete_rows(okay: BoolArray, orders: Orders) -> BoolArray:
    """Tell for which t the output and all past outputs in its regressor were measured, shape (N,)."""
    rows = okay.copy()
    for i in range(1, orders.na + 1):
        rows &= delayed(okay.astype(np.float64), i) > 0
    rows[: orders.n_states] = False
    return rows


def arx(u: FloatArray, y: FloatArray, okay: BoolArray, orders: Orders, sample_time_s: float) -> LinearModel | None:
    """Fit by least squares on the equation error; None if too few unbroken stretches are left of the mask."""
    rows = complete_rows(okay, orders)
    if np.count_nonzero(rows) < 2 * orders.n_parameters:
        return None
    measured = np.where(okay, y, 0.0)
    theta = solve_least_squares(regressor(u, measured, orders)[rows], y[rows])
    return stabilised(LinearModel.from_theta(theta, orders, sample_time_s))


def steiglitz_mcbride(u: FloatArray, y: FloatArray, okay: BoolArray, orders: Orders, start: LinearModel) -> LinearModel:
    """Iterate from a start; outputs that are masked are filled by the last model's simulation."""
    model, rows = start, okay.copy()
    rows[: orders.n_states] = False
    for _ in range(ITERATIONS):
        filled = np.where(okay, y, model.simulate(u))
        u_f, y_f = lfilter([1.0], model.A, u), lfilter([1.0], model.A, filled)
        theta = solve_least_squares(regressor(u_f, y_f, orders)[rows], y_f[rows])
        model = stabilised(LinearModel.from_theta(theta, orders, start.sample_time_s))
    return model


def candidates(
    u: FloatArray, y: FloatArray, okay: BoolArray, orders: Orders, sample_time_s: float
) -> Iterator[LinearModel]:
    """Yield start models, all stable; always at least one."""
    at_rest = LinearModel((0.0,) * orders.na, (0.0,) * orders.nb, orders.nk, sample_time_s)
    first = arx(u, y, okay, orders, sample_time_s)
    if first is not None:
        yield first
    yield steiglitz_mcbride(u, y, okay, orders, first or at_rest)
    high = Orders(HIGH_ORDER, HIGH_ORDER, orders.nk)
    averaging = arx(u, y, okay, high, sample_time_s)
    if averaging is not None:
        smooth = averaging.simulate(u)
        everywhere = np.ones_like(okay)
        begin = arx(u, smooth, everywhere, orders, sample_time_s) or at_rest
        yield steiglitz_mcbride(u, smooth, everywhere, orders, begin)


def subspace(u: FloatArray, y: FloatArray, okay: BoolArray, orders: Orders, sample_time_s: float) -> LinearModel | None:
    """Return the model of order na, made stable; None if too few unbroken stretches are left of the mask."""
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
    """Return the map from the past to the n strongest principal components of predicted outputs, shape (2 PAST, n)."""
    _, powers, axes = np.linalg.svd(R @ ahead, full_matrices=False)
    return np.asarray(ahead @ axes[:n].T / powers[:n], dtype=np.float64)
