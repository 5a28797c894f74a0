"""Correlation: how many independent samples an error holds, and by how many a reading follows its reference."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimator.signals.record import BoolArray, FloatArray, Record, once

LONGEST_LAG = 5


def correlation_length(errors: Sequence[FloatArray]) -> float:
    """Return how many samples of an error count as one: ``1 + 2 sum rho_k^2``.

    This is the factor by which the correlation of a Gaussian series inflates the variance of its mean square, and
    mean squares are what models are compared by (Bayley and Hammersley, J. R. Stat. Soc. Suppl. 8, 1946).
    Correlations are summed to a quarter of the series, less what white noise would add. A correlated error's estimated
    correlations scatter more than that (Bartlett's formula), so the length l errs upward, by up to 0.44 (l - 1): with
    it the F test keeps its level on short series too, without it there are up to twice as many false alarms.
    """
    length = max(error.size for error in errors)
    size = 1 << int(np.ceil(np.log2(2 * length)))
    power = sum(np.abs(np.fft.rfft(error - error.mean(), size)) ** 2 for error in errors)
    covariance = np.fft.irfft(power, size)[: max(length // 4, 2)]
    if covariance[0] <= 0:
        return 1.0
    rho2 = (covariance[1:] / covariance[0]) ** 2
    total = sum(error.size for error in errors)
    return float(1.0 + 2.0 * max(float(np.sum(rho2 - 1.0 / total)), 0.0))


def effective_samples(errors: Sequence[FloatArray]) -> float:
    """Return the number of independent samples that a set of correlated errors is worth."""
    return float(sum(error.size for error in errors) / correlation_length(errors))


@once
def stand_in_variance(record: Record) -> FloatArray:
    """Return the variance of the sum of all torques where one was not read, shape (N,) [Nm²]; 0 where all were."""
    variance = np.zeros(record.time_s.size)
    if record.torque_okay is None:
        return variance
    for torque, trusted in zip(record.torque_nm.T, record.torque_trusted.T, strict=True):
        length = _gap_lengths(trusted)
        for gap in np.unique(length[length > 0]):
            variance[length == gap] += _line_error(torque, int(gap))
    return variance


def _gap_lengths(trusted: BoolArray) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Return how long the gap is that each row belongs to, shape (N,) [samples]; 0 outside of one."""
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], ~trusted, [False]]).astype(np.int8)))
    length = np.zeros(trusted.size, dtype=np.intp)
    for first, end in bounds.reshape(-1, 2):
        length[first:end] = end - first
    return length


def _line_error(torque: FloatArray, gap: int) -> float:
    """Return the mean squared error of a straight line in the middle of a gap of so many rows [Nm²]."""
    whole = min(gap + 1, torque.size - 1)
    half = (whole + 1) // 2
    ends, middle = (torque[:-whole], torque[whole:]), torque[half : torque.size - whole + half]
    line = ends[0] + half / whole * (ends[1] - ends[0])
    return float(np.mean((middle - line) ** 2))


def reading_lag(reading: FloatArray, reference: FloatArray) -> int:
    """Return by how many samples a reading follows its reference: where their covariance is largest in size."""
    n = reading.shape[0] - LONGEST_LAG
    centred = reference[:n] - np.mean(reference[:n])
    return int(np.argmax([abs(float(centred @ reading[lag : lag + n])) for lag in range(LONGEST_LAG + 1)]))
