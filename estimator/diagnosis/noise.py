"""How much of an error is noise: the floor no model gets below, and how many independent samples an error holds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimator.signals.record import FloatArray, Record

PREDICTOR_ORDER = 20
"""Past samples a one-step predictor sees: 0.2 s at 10 ms, more than a period of a driveline's first mode."""


def noise_floor(records: Sequence[Record]) -> float:
    """Estimate the noise of the reading, from the data alone.

    The floor is the RMS error of a linear one-step predictor that sees the last outputs and torques. A predictor
    follows whatever moves slowly, missing physics included, so what it leaves is the noise of the sensor [unit of
    the output].
    """
    squares, count = 0.0, 0
    for record in records:
        errors = _one_step_errors(record)
        squares += float(errors @ errors)
        count += max(errors.size - 2 * PREDICTOR_ORDER - 1, 1)
    return float(np.sqrt(squares / count))


def _one_step_errors(record: Record) -> FloatArray:
    y = np.where(record.okay, record.output, 0.0)
    y = y - y[record.okay].mean()
    u = record.total_torque_nm
    n = PREDICTOR_ORDER
    lags = range(1, n + 1)
    columns = [signal[n - lag : signal.size - lag] for signal in (y, u) for lag in lags]
    regressors = np.column_stack([*columns, np.ones(y.size - n)])
    whole = np.lib.stride_tricks.sliding_window_view(record.okay, n + 1).all(axis=1)
    a, b = regressors[whole], y[n:][whole]
    errors: FloatArray = b - a @ np.linalg.lstsq(a, b, rcond=None)[0]
    return errors


def correlation_length(errors: Sequence[FloatArray]) -> float:
    """Return how many samples of an error count as one: ``1 + 2 sum rho_k^2``.

    This is the factor by which the correlation of a Gaussian series inflates the variance of its mean square, and
    mean squares are what models are compared by (Bayley and Hammersley, J. R. Stat. Soc. Suppl. 8, 1946).
    Correlations are summed to a quarter of the series, less what noise alone would add.
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
