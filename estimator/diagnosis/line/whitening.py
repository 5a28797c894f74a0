"""The Kalman filter that turns a free-run error into its innovations, compiled: gains once, then any signals.

Model: ``x[t+1] = F x[t] + w``, ``y[t] = H x[t] + v`` with ``cov w = Q`` and ``cov v = diag(r)``. What was not observed
is predicted and not corrected, and the outputs of a sample are taken one after the other (Durbin and Koopman, Time
Series Analysis by State Space Methods, chapters 4 and 6.4).
"""

from __future__ import annotations

import numpy as np

from estimator.compiled import compiled
from estimator.diagnosis.line.kalman import product, symmetric_product
from estimator.signals.record import BoolArray, FloatArray

SETTLED = 1e-5
"""Relative change of every state's variance from sample to sample below which the gain no longer changes."""


@compiled
def correct(f: FloatArray, h: FloatArray, r: float, p: FloatArray, ph: FloatArray, gain: FloatArray) -> float:
    """Correct a covariance by one observation, fill the predictor's gain, and return the innovation's variance."""
    m = h.shape[0]
    s = r
    for i in range(m):
        total = 0.0
        for j in range(m):
            total += p[i, j] * h[j]
        ph[i] = total
        s += h[i] * total
    for i in range(m):
        total = 0.0
        for j in range(m):
            total += f[i, j] * ph[j]
            p[i, j] -= ph[i] * ph[j] / s
        gain[i] = total / s
    return s


@compiled
def predict(f: FloatArray, q: FloatArray, p: FloatArray, half: FloatArray, before: FloatArray) -> bool:
    """Move a covariance on by one sample; tell whether it no longer changes. ``before`` keeps the last variances."""
    m = f.shape[0]
    product(f, p, half)
    symmetric_product(half, f.T, p)
    settled = True
    for i in range(m):
        for j in range(m):
            p[i, j] += q[i, j]
        settled = settled and abs(p[i, i] - before[i]) <= SETTLED * p[i, i]
        before[i] = p[i, i]
    return settled


@compiled
def shown_to_later(i: int, h: FloatArray, ph: FloatArray, s: FloatArray, shown: FloatArray) -> None:
    """Fill how the innovations of the outputs before one move its prediction; of those that were observed."""
    for j in range(i):
        shown[i, j] = 0.0
        for k in range(h.shape[1]):
            shown[i, j] += h[i, k] * ph[j, k] / s[j]


@compiled
def fill_gains(
    f: FloatArray,
    h: FloatArray,
    q: FloatArray,
    r: FloatArray,
    prior: FloatArray,
    observed: BoolArray,
    at_input: FloatArray,
    unread: FloatArray,
    gains: FloatArray,
    cross: FloatArray,
    spread: FloatArray,
) -> None:
    """Fill the predictor's gains, shape (N, C, m), and the innovations' standard deviations, shape (C, N).

    The outputs of a sample correct the state in turn: ``cross``, shape (N, C, C), is how the innovation of each moves
    the prediction of those after it.

    Parameters
    ----------
    f, q, prior : ndarray, shape (m, m)
        Transition, covariance of what drives it, and covariance of the first state.
    h : ndarray, shape (C, m)
        How each of C outputs shows the state.
    r : ndarray, shape (C,)
        Variance of each reading.
    observed : ndarray of bool, shape (C, N)
    at_input : ndarray, shape (m,)
        How an input held for a sample moves the state.
    unread : ndarray, shape (N,)
        Variance of the input where it was not read; 0 elsewhere.
    """
    count, m = h.shape
    p, half, ph = prior.copy(), np.empty((m, m)), np.empty((count, m))
    gain, before, s, shown = np.zeros((count, m)), np.zeros(m), np.zeros(count), np.zeros((count, count))
    settled = False
    for t in range(observed.shape[1]):
        settled = settled and bool(np.all(observed[:, t] == observed[:, t - 1]))
        for i in range(count):
            if not settled:
                s[i] = np.inf
                if observed[i, t]:
                    s[i] = correct(f, h[i], r[i], p, ph[i], gain[i])
                    shown_to_later(i, h, ph, s, shown)
            seen = 1.0 if observed[i, t] else 0.0
            gains[t, i], cross[t, i], spread[i, t] = seen * gain[i], seen * shown[i], np.sqrt(s[i])
        if not settled:
            settled = predict(f, q, p, half, before) and bool(np.isfinite(s).any())
        if unread[t] > 0.0:
            settled = False
            for i in range(m):
                for j in range(m):
                    p[i, j] += unread[t] * at_input[i] * at_input[j]


@compiled
def step(f: FloatArray, gains: FloatArray, e: FloatArray, x: FloatArray, moved: FloatArray) -> None:
    """Fill the next state's prediction, shape (m, K), from this one's and the innovations (C, K)."""
    for i in range(f.shape[0]):
        for k in range(e.shape[1]):
            moved[i, k] = gains[0, i] * e[0, k]
        for c in range(1, e.shape[0]):
            for k in range(e.shape[1]):
                moved[i, k] += gains[c, i] * e[c, k]
        for j in range(f.shape[0]):
            a = f[i, j]
            if a != 0.0:
                for k in range(e.shape[1]):
                    moved[i, k] += a * x[j, k]


@compiled
def subtract(shares: FloatArray, rows: FloatArray, count: int, left: FloatArray) -> None:
    """Subtract shares of the first ``count`` rows, shape (count, K), from what is left, shape (K,)."""
    for i in range(count):
        if shares[i] != 0.0:
            for k in range(left.shape[0]):
                left[k] -= shares[i] * rows[i, k]


@compiled
def innovate(
    f: FloatArray, h: FloatArray, gains: FloatArray, cross: FloatArray, spread: FloatArray, signals: FloatArray
) -> None:
    """Replace signals, shape (N, C, K), by their innovations over the standard deviations; 0 where not observed."""
    outputs, m = h.shape
    count = signals.shape[2]
    x, moved, e = np.zeros((m, count)), np.zeros((m, count)), np.zeros((outputs, count))
    for t in range(signals.shape[0]):
        for c in range(outputs):
            for k in range(count):
                e[c, k] = signals[t, c, k]
            subtract(h[c], x, m, e[c])
            subtract(cross[t, c], e, c, e[c])
        step(f, gains[t], e, x, moved)
        x, moved = moved, x
        for c in range(outputs):
            for k in range(count):
                signals[t, c, k] = e[c, k] / spread[c, t]
