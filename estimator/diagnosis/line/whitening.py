"""The Kalman filter that turns a free-run error into its innovations, compiled: gains once, then any signals.

Model: ``x[t+1] = F x[t] + w``, ``y[t] = H x[t] + v`` with ``cov w = Q`` and ``cov v = diag(r)``. What was not observed
is predicted and not corrected, and the outputs of a sample correct the state one after the other (Durbin and Koopman,
Time Series Analysis by State Space Methods, chapters 4 and 6.4). F and H are sparse.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimator.compiled import compiled, inlined
from estimator.lanes import borrowed
from estimator.signals.record import BoolArray, FloatArray, IntArray

SETTLED = 1e-5
"""Relative change of every state's variance from sample to sample below which the gain no longer changes."""


class Terms(NamedTuple):
    """The entries of a matrix that are not 0."""

    rows: IntArray  # (K,)
    columns: IntArray  # (K,)
    values: FloatArray  # (K,): entry ``[rows, columns]``


def terms_of(matrix: FloatArray) -> Terms:
    """Return the entries of a matrix that are not 0."""
    rows, columns = np.nonzero(matrix)
    return Terms(rows, columns, matrix[rows, columns])


class Gains(NamedTuple):
    """What the filter of a recording does with N samples of C outputs."""

    predictor: FloatArray  # (N, C, m): how the innovation of each output moves the next state's prediction
    cross: FloatArray  # (N, C, C): how it moves the predictions of the outputs after it
    spread: FloatArray  # (N, C): standard deviation of each innovation


@inlined
def correct(f: Terms, h: FloatArray, i: int, r: float, p: FloatArray, ph: FloatArray, gain: FloatArray) -> float:
    """Correct a covariance by output i, fill the predictor's gain for it, and return its innovation's variance."""
    m = h.shape[1]
    s = float(r)
    for row in range(m):
        total = 0.0
        for k in range(m):
            total += p[row, k] * h[i, k]
        ph[i, row] = total
        gain[i, row] = 0.0
        s += h[i, row] * total
    for n in range(f.values.size):
        gain[i, f.rows[n]] += f.values[n] * ph[i, f.columns[n]] / s
    for row in range(m):
        for k in range(m):
            p[row, k] -= ph[i, row] * ph[i, k] / s
    return float(s)


@inlined
def shown_by(j: int, i: int, h: FloatArray, ph: FloatArray, s: FloatArray) -> float:
    """Return how the innovation of output j moves the prediction of output i of the same sample."""
    total = 0.0
    for k in range(h.shape[1]):
        total += h[i, k] * ph[j, k]
    return float(total / s[j])


@inlined
def predict(f: Terms, q: FloatArray, p: FloatArray, half: FloatArray, before: FloatArray) -> bool:
    """Move a covariance on by one sample; tell whether it no longer changes. ``before`` keeps the last variances."""
    m = q.shape[0]
    half[:] = 0.0
    for n in range(f.values.size):
        for k in range(m):
            half[f.rows[n], k] += f.values[n] * p[f.columns[n], k]
    for i in range(m):
        for k in range(m):
            p[i, k] = q[i, k]
    for n in range(f.values.size):
        for k in range(m):
            p[f.rows[n], k] += f.values[n] * half[k, f.columns[n]]
    settled = True
    for i in range(m):
        settled = settled and abs(p[i, i] - before[i]) <= SETTLED * p[i, i]
        before[i] = p[i, i]
    return settled


@inlined
def is_as_before(observed: BoolArray, t: int) -> bool:
    """Return whether the same outputs were read in a row as in the one before: only then may a gain be kept."""
    same = True
    for i in range(observed.shape[1]):
        same = same and observed[t, i] == observed[t - 1, i]
    return same


@inlined
def add_input(at_input: FloatArray, n: int, variance: float, p: FloatArray) -> None:
    """Add an input's variance in row n to a covariance of the state, in place."""
    for i in range(p.shape[0]):
        for k in range(p.shape[0]):
            p[i, k] += variance * at_input[n, i] * at_input[n, k]


@compiled
def fill_gains(
    f: Terms,
    h: FloatArray,
    q: FloatArray,
    r: FloatArray,
    prior: FloatArray,
    observed: BoolArray,
    at_input: FloatArray,
    unread: FloatArray,
    gains: Gains,
) -> None:
    """Fill the gains of a recording's filter; see ``fill_gains_in``, which needs no room of its own.

    ``q`` and ``r`` are the variances of state and readings, ``prior`` that of the first state, ``observed`` (N, C)
    which outputs were read, ``at_input`` and ``unread`` how an input that was not read acts, and its variance in each
    row.
    """
    count, m = h.shape
    room = (np.empty((m, m)), np.empty((count, m)), np.empty((count, m)), np.zeros(m), np.empty(count))
    fill_gains_in(f, h, q, r, prior.copy(), observed, at_input, unread, gains, room)


@compiled
def fill_gains_in(
    f: Terms,
    h: FloatArray,
    q: FloatArray,
    r: FloatArray,
    p: FloatArray,
    observed: BoolArray,
    at_input: FloatArray,
    unread: FloatArray,
    gains: Gains,
    room: tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray],
) -> None:
    """Do what ``fill_gains`` does, from the covariance of the first state and with room for what it needs."""
    f = Terms(borrowed(f.rows), borrowed(f.columns), borrowed(f.values))
    h, q, p, observed = borrowed(h), borrowed(q), borrowed(p), borrowed(observed)
    predictor, cross, spread = borrowed(gains.predictor), borrowed(gains.cross), borrowed(gains.spread)
    half, ph, gain, before, s = (
        borrowed(room[0]),
        borrowed(room[1]),
        borrowed(room[2]),
        borrowed(room[3]),
        borrowed(room[4]),
    )
    count, m = h.shape
    settled = False
    for t in range(observed.shape[0]):
        settled = settled and is_as_before(observed, t)
        is_any = False
        for i in range(count):
            if not settled:
                s[i] = correct(f, h, i, r[i], p, ph, gain) if observed[t, i] else np.inf
            is_any = is_any or observed[t, i]
            spread[t, i] = np.sqrt(s[i])
            for k in range(m):
                predictor[t, i, k] = gain[i, k] if observed[t, i] else 0.0
            for j in range(i):
                cross[t, i, j] = shown_by(j, i, h, ph, s) if observed[t, i] and observed[t, j] else 0.0
        if not settled:
            settled = predict(f, q, p, half, before) and is_any
        for n in range(at_input.shape[0]):
            if unread[t, n] > 0.0:
                settled = False
                add_input(at_input, n, unread[t, n], p)


@inlined
def add_products(terms: Terms, sign: float, x: FloatArray, total: FloatArray) -> None:
    """Add a matrix times ``x``, shape (n, K), with a sign to a total, shape (m, K)."""
    for n in range(terms.values.size):
        row, column, value = terms.rows[n], terms.columns[n], sign * terms.values[n]
        for k in range(x.shape[1]):
            total[row, k] += value * x[column, k]


@inlined
def fill_gained(gains: FloatArray, t: int, e: FloatArray, total: FloatArray) -> None:
    """Fill what the innovations of a sample, shape (C, K), do to the next state, shape (m, K)."""
    for row in range(total.shape[0]):
        gain = gains[t, 0, row]
        for k in range(e.shape[1]):
            total[row, k] = gain * e[0, k]
        for i in range(1, e.shape[0]):
            gain = gains[t, i, row]
            for k in range(e.shape[1]):
                total[row, k] += gain * e[i, k]


@compiled
def innovate(f: Terms, h: Terms, gains: Gains, observed: BoolArray, signals: FloatArray) -> None:
    """Replace signals of the samples that were observed by their innovations over the standard deviations."""
    outputs, m, count = observed.shape[1], gains.predictor.shape[2], signals.shape[1]
    places = np.zeros(outputs, dtype=np.int64)
    for i in range(1, outputs):
        places[i] = places[i - 1] + observed[:, i - 1].sum()
    room = (np.zeros((m, count)), np.zeros((m, count)), np.zeros((outputs, count)))
    innovate_in(f, h, gains, observed, signals, places, room)


@compiled
def innovate_in(
    f: Terms,
    h: Terms,
    gains: Gains,
    observed: BoolArray,
    signals: FloatArray,
    places: IntArray,
    room: tuple[FloatArray, FloatArray, FloatArray],
) -> None:
    """Do what ``innovate`` does, from where each output begins, with room for two states and the innovations."""
    f = Terms(borrowed(f.rows), borrowed(f.columns), borrowed(f.values))
    h = Terms(borrowed(h.rows), borrowed(h.columns), borrowed(h.values))
    predictor, cross, spread = borrowed(gains.predictor), borrowed(gains.cross), borrowed(gains.spread)
    observed, signals, places = borrowed(observed), borrowed(signals), borrowed(places)
    x, moved, e = borrowed(room[0]), borrowed(room[1]), borrowed(room[2])
    for t in range(observed.shape[0]):
        take(observed, t, signals, places, e)
        add_products(h, -1.0, x, e)
        for i in range(1, e.shape[0]):
            for j in range(i):
                for k in range(e.shape[1]):
                    e[i, k] -= cross[t, i, j] * e[j, k]
        fill_gained(predictor, t, e, moved)
        add_products(f, 1.0, x, moved)
        x, moved = moved, x
        for i in range(e.shape[0]):
            if observed[t, i]:
                for k in range(e.shape[1]):
                    signals[places[i], k] = e[i, k] / spread[t, i]
                places[i] += 1


@inlined
def take(observed: BoolArray, t: int, signals: FloatArray, places: IntArray, e: FloatArray) -> None:
    """Fill the signals of a sample, shape (C, K); 0 where nothing was observed."""
    for i in range(e.shape[0]):
        for k in range(e.shape[1]):
            e[i, k] = signals[places[i], k] if observed[t, i] else 0.0
