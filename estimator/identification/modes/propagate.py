"""What the uncertainty of parameters does to anything computed from them.

The delta method: for a function g of estimated parameters with covariance P, ``cov g = G P G^T`` with G its
derivative (L. Ljung, System Identification, 2nd ed., section 9.A). The derivative is taken along the principal axes
of P, a hundredth of a standard deviation to either side: where poles and zeros cancel, single coefficients may move
far, but only together, and a difference taken coefficient by coefficient would leave that valley.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from estimator.signals.record import FloatArray

CONFIDENCE = 0.95
"""Of every interval and ellipse that does not say otherwise."""

QUANTILE = float(norm.ppf(0.5 + CONFIDENCE / 2.0))
"""Half width of such an interval in standard deviations: 1.96."""

STEP = 0.01
"""Of the difference quotient, in standard deviations."""


@dataclass(frozen=True, slots=True)
class Uncertain:
    """A number and its standard deviation; infinite where the data say nothing of it.

    Attributes
    ----------
    value, std : float
    is_reciprocal : bool
        Whether its reciprocal is what the data determine linearly, as of an inertia: the interval is then one of the
        reciprocal, and reaches further up than down.
    """

    value: float
    std: float
    is_reciprocal: bool = False

    @property
    def ci95(self) -> tuple[float, float]:
        """Interval that holds the truth with 95 % probability."""
        reach = QUANTILE * self.std
        if not self.is_reciprocal or self.value <= 0.0 or not math.isfinite(reach):
            return self.value - reach, self.value + reach
        share = reach / self.value
        return self.value / (1.0 + share), self.value / (1.0 - share) if share < 1.0 else math.inf

    @property
    def is_determined(self) -> bool:
        """Tell whether the interval leaves out 0: size and sign are known."""
        return math.isfinite(self.std) and abs(self.value) > QUANTILE * self.std

    def covers(self, truth: float) -> bool:
        """Tell whether the interval holds a value."""
        low, high = self.ci95
        return low <= truth <= high


def square_root(covariance: FloatArray) -> FloatArray:
    """Return S with ``S S^T = P``, its columns along the principal axes; rounding below zero counts as zero."""
    variances, axes = np.linalg.eigh(0.5 * (covariance + covariance.T))
    return np.asarray(axes * np.sqrt(np.maximum(variances, 0.0)), dtype=np.float64)


def propagate(
    function: Callable[[FloatArray], FloatArray], parameters: FloatArray, covariance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return a function's value, shape (m,), and its covariance, shape (m, m).

    Parameters
    ----------
    function
        From parameters, shape (n,), to values, shape (m,); smooth near ``parameters``.
    parameters : ndarray, shape (n,)
        Estimate.
    covariance : ndarray, shape (n, n)
        Of the estimate; may be singular.
    """
    axes = square_root(covariance).T
    value = function(parameters)
    slopes = [(function(parameters + STEP * axis) - function(parameters - STEP * axis)) / (2.0 * STEP) for axis in axes]
    G = np.array(slopes).reshape(axes.shape[0], value.shape[0])
    return value, G.T @ G


def uncertain(values: FloatArray, covariance: FloatArray) -> tuple[Uncertain, ...]:
    """Pair each value with its standard deviation."""
    deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return tuple(Uncertain(float(value), float(std)) for value, std in zip(values, deviations, strict=True))
