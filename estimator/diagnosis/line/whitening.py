"""The Kalman filter that turns a free-run error into its innovations, compiled: gains once, then any signals.

Model: ``x[t+1] = F x[t] + w``, ``y[t] = h x[t] + v`` with ``cov w = Q`` and ``var v = r``. A sample that was not
observed is predicted and not corrected (Durbin and Koopman, Time Series Analysis by State Space Methods, chapter 4).
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
def fill_gains(
    f: FloatArray,
    h: FloatArray,
    q: FloatArray,
    r: float,
    prior: FloatArray,
    observed: BoolArray,
    at_input: FloatArray,
    unread: FloatArray,
    gains: FloatArray,
    spread: FloatArray,
) -> None:
    """Fill the predictor's gains, shape (N, m), and the innovations' standard deviations, shape (N,).

    Parameters
    ----------
    f, q, prior : ndarray, shape (m, m)
        Transition, covariance of what drives it, and covariance of the first state.
    h, at_input : ndarray, shape (m,)
        How the output shows the state, and how an input held for a sample moves it.
    observed : ndarray of bool, shape (N,)
    unread : ndarray, shape (N,)
        Variance of the input where it was not read; 0 elsewhere.
    """
    m = h.shape[0]
    p, half, ph = prior.copy(), np.empty((m, m)), np.empty(m)
    gain, before = np.zeros(m), np.zeros(m)
    settled, s = False, 0.0
    for t in range(observed.shape[0]):
        if observed[t]:
            if not settled:
                s = correct(f, h, r, p, ph, gain)
            gains[t] = gain
            spread[t] = np.sqrt(s)
        else:
            settled = False
            gains[t] = 0.0
            spread[t] = np.inf
        if not settled:
            settled = predict(f, q, p, half, before) and observed[t]
        if unread[t] > 0.0:
            settled = False
            for i in range(m):
                for j in range(m):
                    p[i, j] += unread[t] * at_input[i] * at_input[j]


@compiled
def step(f: FloatArray, gain: FloatArray, e: FloatArray, x: FloatArray, moved: FloatArray) -> None:
    """Fill the next state's prediction, shape (m, K), from this one's and the innovations (K,)."""
    for i in range(f.shape[0]):
        for k in range(e.shape[0]):
            moved[i, k] = gain[i] * e[k]
        for j in range(f.shape[0]):
            a = f[i, j]
            if a != 0.0:
                for k in range(e.shape[0]):
                    moved[i, k] += a * x[j, k]


@compiled
def innovate(f: FloatArray, h: FloatArray, gains: FloatArray, spread: FloatArray, signals: FloatArray) -> None:
    """Replace signals, shape (N, K), by their innovations over the standard deviations; 0 where not observed."""
    m, count = h.shape[0], signals.shape[1]
    x, moved, e = np.zeros((m, count)), np.zeros((m, count)), np.zeros(count)
    for t in range(signals.shape[0]):
        for k in range(count):
            e[k] = signals[t, k]
        for i in range(m):
            if h[i] != 0.0:
                for k in range(count):
                    e[k] -= h[i] * x[i, k]
        step(f, gains[t], e, x, moved)
        x, moved = moved, x
        for k in range(count):
            signals[t, k] = e[k] / spread[t]
