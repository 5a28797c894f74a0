"""Fixed-interval Kalman smoother of a linearised line under one unknown input, compiled.

State: that of the line, and last the input, which keeps a share of itself from block to block and walks at random.
Filter forward, smoother backward (Durbin and Koopman, Time Series Analysis by State Space Methods, chapter 4).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimator.compiled import compiled
from estimator.signals.record import FloatArray


class Chain(NamedTuple):
    """The line as the input sees it, over B blocks, or 1 that stands for all.

    Attributes
    ----------
    phi : ndarray, shape (B, n, n)
        How the state moves on.
    drive : ndarray, shape (B, n)
        How the input acts on it.
    c, direct : ndarray, shapes (B, n) and (B,)
        How state and input show in the output.
    memory : float
        Share of the input that is there in the next block.
    walk : float
        Variance of its change from block to block.
    """

    phi: FloatArray
    drive: FloatArray
    c: FloatArray
    direct: FloatArray
    memory: float
    walk: float


class Filtered(NamedTuple):
    """What the smoother needs of the filter: predictions, gains, surprises and their precision (0: not observed)."""

    means: FloatArray
    covariances: FloatArray
    gains: FloatArray
    surprises: FloatArray
    precisions: FloatArray


@compiled
def row_times_column(a: FloatArray, row: int, b: FloatArray, column: int) -> float:
    """Return one entry of ``a b``."""
    total = 0.0
    for k in range(a.shape[1]):
        total += a[row, k] * b[k, column]
    return total


@compiled
def product(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """Fill ``out`` with ``a b``; small matrices."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = row_times_column(a, i, b, j)


@compiled
def symmetric_product(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """Fill ``out`` with ``a b`` where that is symmetric, and keep it so to the last bit."""
    for i in range(out.shape[0]):
        for j in range(i + 1):
            out[i, j] = row_times_column(a, i, b, j)
            out[j, i] = out[i, j]


@compiled
def load(chain: Chain, block: int, f: FloatArray, h: FloatArray) -> None:
    """Fill the transition and the observation of one block."""
    n = chain.phi.shape[1]
    i = block if chain.phi.shape[0] > 1 else 0
    for r in range(n):
        for j in range(n):
            f[r, j] = chain.phi[i, r, j]
        f[r, n] = chain.drive[i, r]
        h[r] = chain.c[i, r]
    h[n] = chain.direct[i]
    f[n, n] = chain.memory


@compiled
def observe(
    error: float, noise: float, h: FloatArray, mean: FloatArray, covariance: FloatArray, gain: FloatArray
) -> tuple[float, float]:
    """Correct the prediction by one observation; return the surprise and its precision, and fill the gain."""
    m = h.shape[0]
    surprise, spread = error, noise
    for r in range(m):
        total = 0.0
        for j in range(m):
            total += covariance[r, j] * h[j]
        gain[r] = total
        surprise -= h[r] * mean[r]
        spread += h[r] * total
    for r in range(m):
        mean[r] += gain[r] * surprise / spread
        for j in range(m):
            covariance[r, j] -= gain[r] * gain[j] / spread
    for r in range(m):
        gain[r] /= spread
    return surprise, 1.0 / spread


@compiled
def run_filter(
    chain: Chain, error: FloatArray, weight: FloatArray, noise: float, prior: FloatArray, kept: Filtered
) -> float:
    """Return the log-likelihood of an error; keep what the smoother needs where ``kept`` has room.

    Parameters
    ----------
    error, weight : ndarray, shape (B,)
        Observed output and how many samples each of its values averages; 0 is not observed.
    noise : float
        Variance of one sample.
    prior : ndarray, shape (m, m)
        Covariance before the first block.
    """
    m = prior.shape[0]
    keep = kept.surprises.shape[0] > 0
    f, h, half = np.zeros((m, m)), np.zeros(m), np.zeros((m, m))
    mean, moved, gain = np.zeros(m), np.zeros(m), np.zeros(m)
    covariance = prior.copy()
    likelihood = 0.0
    for b in range(error.shape[0]):
        if b == 0 or chain.phi.shape[0] > 1:
            load(chain, b, f, h)
        if keep:
            kept.means[b] = mean
            kept.covariances[b] = covariance
        if weight[b] > 0.0:
            surprise, precision = observe(error[b], noise / weight[b], h, mean, covariance, gain)
            likelihood -= 0.5 * (np.log(2.0 * np.pi / precision) + surprise * surprise * precision)
            if keep:
                kept.surprises[b] = surprise
                kept.precisions[b] = precision
                kept.gains[b] = gain
        for r in range(m):
            moved[r] = 0.0
            for j in range(m):
                moved[r] += f[r, j] * mean[j]
        mean[:] = moved
        product(f, covariance, half)
        symmetric_product(half, f.T, covariance)
        covariance[m - 1, m - 1] += chain.walk
    return likelihood


@compiled
def fill_step(f: FloatArray, gain: FloatArray, h: FloatArray, step: FloatArray) -> None:
    """Fill how the filter's error moves on: ``f (1 - gain h')``."""
    m = h.shape[0]
    for r in range(m):
        pull = 0.0
        for j in range(m):
            pull += f[r, j] * gain[j]
        for j in range(m):
            step[r, j] = f[r, j] - pull * h[j]


@compiled
def run_smoother(chain: Chain, kept: Filtered, estimates: FloatArray, variance: FloatArray) -> None:
    """Go back over what the filter kept: fill the estimates, shape (B, m), and the input's variance, shape (B,)."""
    m = kept.means.shape[1]
    f, h, step, half = np.zeros((m, m)), np.zeros(m), np.zeros((m, m)), np.zeros((m, m))
    score, back, information = np.zeros(m), np.zeros(m), np.zeros((m, m))
    for b in range(kept.surprises.shape[0] - 1, -1, -1):
        load(chain, b, f, h)
        precision = kept.precisions[b]
        fill_step(f, kept.gains[b], h, step)
        for r in range(m):
            back[r] = h[r] * kept.surprises[b] * precision
            for j in range(m):
                back[r] += step[j, r] * score[j]
        score[:] = back
        product(information, step, half)
        product(step.T, half, information)
        spread = kept.covariances[b, m - 1, m - 1]
        for r in range(m):
            estimates[b, r] = kept.means[b, r]
            for j in range(m):
                information[r, j] += h[r] * h[j] * precision
                estimates[b, r] += kept.covariances[b, r, j] * score[j]
        for r in range(m):
            for j in range(m):
                spread -= kept.covariances[b, m - 1, r] * information[r, j] * kept.covariances[b, j, m - 1]
        variance[b] = spread
