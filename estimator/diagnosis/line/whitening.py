"""The Kalman filter that turns a free-run error into its innovations, compiled.

Model: ``x[t+1] = F x[t] + w``, ``y[t] = H x[t] + v`` with ``cov w = Q`` and ``cov v = diag(r)``. What was not observed
is predicted and not corrected, and the outputs of a sample correct the state one after the other (Durbin and Koopman,
Time Series Analysis by State Space Methods, chapters 4 and 6.4). F and H are sparse.

It runs in two ways. Of one noise model the gains are kept, and turn any signals into innovations: the columns of a
Jacobian. Of eight at once, side by side in lanes, one error has its innovations: what the sizes of disturbances are
estimated from. The steps of the covariance are written once: of numbers, or of lanes.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from estimator.compiled import compiled, inlined
from estimator.lanes import LANES, as_lanes, borrowed, broadcast_as
from estimator.signals.record import BoolArray, FloatArray, IntArray

SETTLED = 1e-9
"""Relative change of every state's variance from sample to sample below which the gain no longer changes. What is yet
to come adds up over the slowest state's time; filters side by side, by which sizes are estimated, never hold a gain."""


class Terms(NamedTuple):
    """The entries of a matrix that are not 0."""

    rows: IntArray  # (K,)
    columns: IntArray  # (K,)
    values: FloatArray  # (K,): entry ``[rows, columns]``; (K, L) of L noise models


class StateSpace(NamedTuple):
    """The model of an error: m states, C outputs, n inputs that were not read; of L noise models each (..., L)."""

    f: Terms  # (m, m): how the state changes from sample to sample
    h: Terms  # (C, m): how each output shows it
    q: FloatArray  # (m m,): covariance of what drives the state
    r: FloatArray  # (C,): variance of each reading
    prior: FloatArray  # (m m,): covariance of the first state
    at_input: FloatArray  # (n, m): how an input that was not read acts
    share: FloatArray  # (n,): by what its variance in a sample is multiplied

    def at(self, index: int) -> StateSpace:
        """Return that of one of several noise models."""
        f = self.f._replace(values=self.f.values[:, index].copy())
        one = {name: getattr(self, name)[:, index].copy() for name in ("q", "r", "prior", "share")}
        return self._replace(f=f, **one)


def terms_of(matrix: FloatArray) -> Terms:
    """Return the entries of a matrix, shape (R, C) or (R, C, L), that are not 0."""
    rows, columns = np.nonzero(matrix if matrix.ndim == 2 else matrix.any(axis=2))
    return Terms(rows, columns, matrix[rows, columns])


class Gains(NamedTuple):
    """What the filter of a recording does with N samples of C outputs."""

    predictor: FloatArray  # (N, C, m): how the innovation of each output moves the next state's prediction
    cross: FloatArray  # (N, C, C): how it moves the predictions of the outputs after it
    spread: FloatArray  # (N, C): standard deviation of each innovation


@inlined
def surprise(h: Terms, i: int, r: FloatArray, p: FloatArray, ph: FloatArray, m: int) -> float:
    """Fill the covariance of the state and output i, shape (m,), and return the variance of its innovation."""
    for row in range(m):
        ph[row] = broadcast_as(0.0, r[i])
    for n in range(h.rows.size):
        if h.rows[n] == i:
            for row in range(m):
                ph[row] = ph[row] + h.values[n] * p[h.columns[n] * m + row]
    return r[i] + shown(h, i, ph)


@inlined
def shown(h: Terms, i: int, x: FloatArray) -> float:
    """Return what output i shows of a state."""
    total = broadcast_as(0.0, x[0])
    for n in range(h.rows.size):
        if h.rows[n] == i:
            total = total + h.values[n] * x[h.columns[n]]
    return total


@inlined
def correct(p: FloatArray, ph: FloatArray, s: float, m: int) -> None:
    """Correct a covariance by an output, as ``surprise`` found it."""
    for row in range(m):
        gain = ph[row] / s
        for k in range(row + 1):
            p[row * m + k] = p[row * m + k] - gain * ph[k]
            p[k * m + row] = p[row * m + k]


@inlined
def predict(f: Terms, q: FloatArray, p: FloatArray, half: FloatArray, m: int) -> None:
    """Move a covariance on by one sample; both triangles are kept, so that each row is read in turn."""
    for i in range(m * m):
        half[i] = broadcast_as(0.0, q[i])
    for n in range(f.rows.size):
        for k in range(m):
            half[f.rows[n] * m + k] = half[f.rows[n] * m + k] + f.values[n] * p[f.columns[n] * m + k]
    for i in range(m * m):
        p[i] = q[i]
    for n in range(f.rows.size):
        row, column = f.rows[n], f.columns[n]
        for k in range(row, m):
            p[k * m + row] = p[k * m + row] + f.values[n] * half[k * m + column]
    for row in range(m):
        for k in range(row):
            p[k * m + row] = p[row * m + k]


@inlined
def add_inputs(at_input: FloatArray, share: FloatArray, unread: FloatArray, p: FloatArray, m: int) -> bool:
    """Add the variances of the inputs that a sample, shape (n,), did not read; tell whether there are any."""
    is_any = False
    for n in range(unread.size):
        if unread[n] > 0.0:
            is_any = True
            for i in range(m):
                for k in range(m):
                    p[i * m + k] = p[i * m + k] + at_input[n, i] * at_input[n, k] * unread[n] * share[n]
    return is_any


@inlined
def is_steady(p: FloatArray, before: FloatArray, m: int) -> bool:
    """Tell whether variances no longer change; ``before`` keeps the last ones."""
    steady = True
    for i in range(m):
        steady = steady and abs(p[i * m + i] - before[i]) <= SETTLED * p[i * m + i]
        before[i] = p[i * m + i]
    return steady


@inlined
def is_as_before(observed: BoolArray, t: int) -> bool:
    """Return whether the same outputs were read in a row as in the one before: only then may a gain be kept."""
    same = True
    for i in range(observed.shape[1]):
        same = same and observed[t, i] == observed[t - 1, i]
    return same


@compiled
def fill_gains(
    model: StateSpace,
    observed: BoolArray,
    unread: FloatArray,
    gains: Gains,
    p: FloatArray,
    room: tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray],
) -> None:
    """Fill the gains of a recording's filter under one noise model.

    ``observed``, shape (N, C), says which outputs were read, ``unread``, shape (N, n), the variance of each input
    before its share. ``p`` is the covariance of the first state, which is written over; ``room`` is for a covariance,
    two (C, m), and (m,) and (C,).
    """
    f = Terms(borrowed(model.f.rows), borrowed(model.f.columns), borrowed(model.f.values))
    h = Terms(borrowed(model.h.rows), borrowed(model.h.columns), borrowed(model.h.values))
    q, r, at_input, share = borrowed(model.q), borrowed(model.r), borrowed(model.at_input), borrowed(model.share)
    p, observed, unread = borrowed(p), borrowed(observed), borrowed(unread)
    predictor, cross, spread = borrowed(gains.predictor), borrowed(gains.cross), borrowed(gains.spread)
    half, ph, gain = borrowed(room[0]), borrowed(room[1]), borrowed(room[2])
    before, s = borrowed(room[3]), borrowed(room[4])
    count, m = r.size, at_input.shape[1]
    settled = False
    for t in range(observed.shape[0]):
        settled = settled and is_as_before(observed, t)
        is_any = False
        for i in range(count):
            if not settled:
                s[i] = np.inf
                if observed[t, i]:
                    s[i] = surprise(h, i, r, p, ph[i], m)
                    gain[i] = 0.0
                    for n in range(f.rows.size):
                        gain[i, f.rows[n]] += f.values[n] * ph[i, f.columns[n]] / s[i]
                    correct(p, ph[i], s[i], m)
            is_any = is_any or observed[t, i]
            spread[t, i] = sqrt(s[i])
            for k in range(m):
                predictor[t, i, k] = gain[i, k] if observed[t, i] else 0.0
            for j in range(i):
                cross[t, i, j] = shown(h, i, ph[j]) / s[j] if observed[t, i] and observed[t, j] else 0.0
        if not settled:
            predict(f, q, p, half, m)
            settled = is_steady(p, before, m) and is_any
        settled = not add_inputs(at_input, share, unread[t], p, m) and settled


@compiled
def innovate_each(
    model: StateSpace,
    observed: BoolArray,
    unread: FloatArray,
    error: FloatArray,
    places: IntArray,
    p: FloatArray,
    room: tuple[FloatArray, FloatArray, FloatArray],
    innovations: FloatArray,
    variances: FloatArray,
) -> None:
    """Fill the innovations of one error, shape (R,), and their variances under noise models in lanes, (R, LANES).

    ``places``, shape (C,), is where each output's samples begin, ``p`` the covariance of the first state, which is
    written over, and ``room`` is for a covariance and two states, each (..., LANES).
    """
    h = Terms(borrowed(model.h.rows), borrowed(model.h.columns), borrowed(model.h.values))
    rows, columns, at_input = borrowed(model.f.rows), borrowed(model.f.columns), borrowed(model.at_input)
    f, q, r = as_lanes(borrowed(model.f.values)), as_lanes(borrowed(model.q)), as_lanes(borrowed(model.r))
    share, e, s = as_lanes(borrowed(model.share)), as_lanes(borrowed(innovations)), as_lanes(borrowed(variances))
    covariance, half = as_lanes(borrowed(p)), as_lanes(borrowed(room[0]))
    x, moved = as_lanes(borrowed(room[1])), as_lanes(borrowed(room[2]))
    observed, unread, error, places = borrowed(observed), borrowed(unread), borrowed(error), borrowed(places)
    m = at_input.shape[1]
    for t in range(observed.shape[0]):
        for i in range(observed.shape[1]):
            if observed[t, i]:
                row = places[i]
                s[row] = surprise(h, i, r, covariance, moved, m)
                e[row] = error[row] - shown(h, i, x)
                correct(covariance, moved, s[row], m)
                for k in range(m):
                    x[k] = x[k] + moved[k] * (e[row] / s[row])
                places[i] += 1
        for k in range(m):
            moved[k] = broadcast_as(0.0, r[0])
        for n in range(rows.size):
            moved[rows[n]] = moved[rows[n]] + f[n] * x[columns[n]]
        for k in range(m):
            x[k] = moved[k]
        predict(Terms(rows, columns, f), q, covariance, half, m)
        add_inputs(at_input, share, unread[t], covariance, m)


def innovations_of(
    models: StateSpace, observed: BoolArray, unread: FloatArray, error: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the innovations of one error and their variances under `LANES` noise models, each (R, LANES).

    ``observed``, (N, C), says which outputs were read, ``unread``, (N, n), the variance of each input before its share;
    ``error``, (R,), has the samples that were observed, of one output after the other.
    """
    m, (values, variances) = models.at_input.shape[1], np.empty((2, error.size, LANES))
    room = np.zeros((m * m, LANES)), np.zeros((m, LANES)), np.zeros((m, LANES))
    innovate_each(models, observed, unread, error, beginnings(observed), models.prior.copy(), room, values, variances)
    return values, variances


def beginnings(observed: BoolArray) -> IntArray:
    """Return where the samples of each output begin, shape (C,), in a stack of those that were observed, (N, C)."""
    counts = observed.sum(axis=0)
    found: IntArray = np.cumsum(counts) - counts
    return found


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
def innovate(
    f: Terms,
    h: Terms,
    gains: Gains,
    observed: BoolArray,
    signals: FloatArray,
    places: IntArray,
    room: tuple[FloatArray, ...],
) -> None:
    """Replace signals of the samples that were observed, (R, K), by their innovations over the standard deviations.

    ``places``, shape (C,), is where each output's samples begin; ``room`` is for two states and the innovations, each
    of K columns.
    """
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
