"""How many independent samples an error holds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimator.signals.record import FloatArray


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
