"""The functions that a sparse regression may choose from, and the free run of what it chose.

All monomials of the signals up to a degree; and of each signal its sign and ``z |z|``, the shapes of dry friction and
of drag. One compiled function says what they are, for the regression and for the simulation.
"""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np

from estimator.compiled import compiled
from estimator.signals.record import FloatArray, IntArray

RUNAWAY = 1e3
"""A state this many times its own scale has run away; it stays there."""


def powers(signals: int, degree: int) -> IntArray:
    """Return the exponent of each signal in each monomial up to a degree, shape (K, signals)."""
    chosen = [which for d in range(degree + 1) for which in combinations_with_replacement(range(signals), d)]
    return np.array([[which.count(i) for i in range(signals)] for which in chosen], dtype=np.int64)


@compiled
def features(z: FloatArray, exponents: IntArray, out: FloatArray) -> None:
    """Write the features of one sample (M,) into ``out`` (K + 2 M,)."""
    count, signals = exponents.shape
    for k in range(count):
        product = 1.0
        for i in range(signals):
            for _ in range(exponents[k, i]):
                product *= z[i]
        out[k] = product
    for i in range(signals):
        out[count + i] = np.sign(z[i])
        out[count + signals + i] = z[i] * abs(z[i])


@compiled
def table(z: FloatArray, exponents: IntArray) -> FloatArray:
    """Return the features of every sample; ``z`` of shape (n, M), the result (n, K + 2 M)."""
    out = np.empty((z.shape[0], exponents.shape[0] + 2 * z.shape[1]))
    for n in range(z.shape[0]):
        features(z[n], exponents, out[n])
    return out


@compiled
def free_runs(own: FloatArray, inputs: FloatArray, xi: FloatArray, exponents: IntArray, step_s: float) -> FloatArray:
    """Return free runs of ``dx/dt = xi features(x, u) + c``, c in the last state alone.

    Runge-Kutta of fourth order, the input held from sample to sample.

    Parameters
    ----------
    own : ndarray, shape (P, S + 1)
        Initial states and constant of each run.
    inputs : ndarray, shape (n, M)
    xi : ndarray, shape (S, K + 2 (S + M))

    Returns
    -------
    ndarray, shape (P, n)
        First state of each run.
    """
    runs, states = own.shape[0], own.shape[1] - 1
    n, m = inputs.shape
    outputs = np.empty((runs, n))
    z, terms = np.empty(states + m), np.empty(exponents.shape[0] + 2 * (states + m))
    x, rate, change = np.empty(states), np.empty(states), np.empty(states)
    for run in range(runs):
        x[:] = own[run, :states]
        for k in range(n):
            outputs[run, k] = x[0]
            z[states:] = inputs[k]
            change[:] = 0.0
            rate[:] = 0.0
            for stage in range(4):
                reach = step_s if stage == 3 else (0.0 if stage == 0 else 0.5 * step_s)
                for i in range(states):
                    z[i] = x[i] + reach * rate[i]
                features(z, exponents, terms)
                for i in range(states):
                    rate[i] = 0.0
                    for j in range(terms.size):
                        rate[i] += xi[i, j] * terms[j]
                rate[states - 1] += own[run, states]
                weight = 1.0 if stage == 0 or stage == 3 else 2.0
                for i in range(states):
                    change[i] += weight * rate[i]
            for i in range(states):
                x[i] = min(max(x[i] + step_s / 6.0 * change[i], -RUNAWAY), RUNAWAY)
    return outputs
