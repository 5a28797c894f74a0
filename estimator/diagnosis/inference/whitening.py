"""The Kalman filter that turns a free-run error into its innovations, compiled: gains once, then any signals.

Model: ``x[t+1] = F x[t] + w``, ``y[t] = h x[t] + v`` with ``cov w = Q`` and ``var v = r``. A sample that was not
observed is predicted and not corrected (Durbin and Koopman, Time Series Analysis by State Space Methods, chapter 4).
"""

from __future__ import annotations

import numpy as np

from estimator.compiled import compiled
from estimator.signals.record import BoolArray, FloatArray

SETTLED = 1e-5
"""Relative change of every state's variance from sample to sample below which the gain no longer changes."""


@compiled
def fill_gains(
    f: FloatArray,
    h: FloatArray,
    q: FloatArray,
    r: float,
    prior: FloatArray,
    observed: BoolArray,
    gains: FloatArray,
    spread: FloatArray,
) -> None:
    """Fill the predictor's gains, shape (N, m), and the innovations' standard deviations, shape (N,).

    Parameters
    ----------
    f, q, prior : ndarray, shape (m, m)
        Transition, covariance of what drives it, and covariance of the first state.
    h : ndarray, shape (m,)
    observed : ndarray of bool, shape (N,)
    """
    m = h.shape[0]
    p, half, ph = prior.copy(), np.empty((m, m)), np.empty(m)
    gain, before = np.zeros(m), np.zeros(m)
    settled, last = False, 0.0
    for t in range(observed.shape[0]):
        if not observed[t]:
            settled = False
            for i in range(m):
                gains[t, i] = 0.0
            spread[t] = np.inf
        else:
            if not settled:
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
                    gain[i] = total / s
                for i in range(m):
                    for j in range(m):
                        p[i, j] -= ph[i] * ph[j] / s
                last = s
            for i in range(m):
                gains[t, i] = gain[i]
            spread[t] = np.sqrt(last)
        if not settled:
            for i in range(m):
                for j in range(m):
                    total = 0.0
                    for k in range(m):
                        total += f[i, k] * p[k, j]
                    half[i, j] = total
            settled = observed[t]
            for i in range(m):
                for j in range(i + 1):
                    total = q[i, j]
                    for k in range(m):
                        total += half[i, k] * f[j, k]
                    if i == j and abs(total - before[i]) > SETTLED * total:
                        settled = False
                    p[i, j] = total
                    p[j, i] = total
                before[i] = p[i, i]


@compiled
def innovate(f: FloatArray, h: FloatArray, gains: FloatArray, spread: FloatArray, signals: FloatArray) -> None:
    """Replace signals, shape (N, K), by their innovations over the standard deviations; 0 where not observed."""
    m, count = h.shape[0], signals.shape[1]
    x, moved, e = np.zeros((m, count)), np.zeros((m, count)), np.zeros(count)
    for t in range(signals.shape[0]):
        seen = spread[t] < np.inf
        for k in range(count):
            e[k] = signals[t, k]
        for i in range(m):
            if h[i] != 0.0:
                for k in range(count):
                    e[k] -= h[i] * x[i, k]
        for i in range(m):
            g = gains[t, i]
            if seen:
                for k in range(count):
                    moved[i, k] = g * e[k]
            else:
                for k in range(count):
                    moved[i, k] = 0.0
            for j in range(m):
                a = f[i, j]
                if a != 0.0:
                    for k in range(count):
                        moved[i, k] += a * x[j, k]
        x[:, :] = moved
        scale = 1.0 / spread[t]
        for k in range(count):
            signals[t, k] = e[k] * scale if seen else 0.0
