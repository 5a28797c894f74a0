"""Which poles and zeros cancel, as far as the data can tell.

They do if their difference d is no larger than its own uncertainty: ``d^T cov(d)^-1 d`` within its chi-square
quantile. Pole and zero are estimated from the same data and move together, so their difference is far better known
than either.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.stats import chi2

from estimator.identification.modes.roots import Roots, covariance_of
from estimator.signals.record import FloatArray

FAR = 1e6
"""Squared distance, in units of its uncertainty, beyond which none is farther: a thousand standard deviations."""


@dataclass(frozen=True, slots=True)
class Cancellation:
    """A pole and a zero that the data can't tell apart.

    Attributes
    ----------
    pole, zero : complex
        In z; of a conjugate pair the one with positive imaginary part.
    p_value : float
        Probability of a distance at least this large if they were one.
    """

    pole: complex
    zero: complex
    p_value: float

    @property
    def statement(self) -> str:
        """What it means, in a sentence."""
        kind = "pair" if self.pole.imag else "pole"
        return (
            f"The {kind} at {self.pole:.3f} and the zero at {self.zero:.3f} can't be distinguished "
            f"(p = {self.p_value:.2g}): the data do not need this {kind}."
        )


def cancellations(poles: Roots, zeros: Roots, P: FloatArray, confidence: float) -> tuple[Cancellation, ...]:
    """Pair poles and zeros of one kind, closest in units of their uncertainty first, each at most once."""
    found = []
    for imaginary, freedom in ((False, 1), (True, 2)):
        p_at, z_at = (
            np.flatnonzero(roots.values.imag > 0 if imaginary else roots.values.imag == 0) for roots in (poles, zeros)
        )
        distance = np.array([[_distance(poles, int(i), zeros, int(j), P, freedom) for j in z_at] for i in p_at])
        for row, column in zip(*linear_sum_assignment(distance.reshape(len(p_at), len(z_at))), strict=True):
            p_value = float(chi2.sf(distance[row, column], freedom))
            if p_value > 1.0 - confidence:
                found.append(
                    Cancellation(complex(poles.values[p_at[row]]), complex(zeros.values[z_at[column]]), p_value)
                )
    return tuple(found)


def _distance(poles: Roots, i: int, zeros: Roots, j: int, P: FloatArray, freedom: int) -> float:
    """Return the squared distance of a pole and a zero in units of its own uncertainty."""
    apart = zeros.values[j] - poles.values[i]
    spread = covariance_of(zeros.slopes[j] - poles.slopes[i], P)[:freedom, :freedom]
    d = np.array([apart.real, apart.imag])[:freedom]
    if not np.isfinite(spread).all():
        return 0.0
    variances, axes = np.linalg.eigh(spread)
    floor = max(float(variances[-1]) * np.finfo(np.float64).eps, np.finfo(np.float64).tiny)
    return float(min(np.sum((axes.T @ d) ** 2 / np.maximum(variances, floor)), FAR))
