"""The residual's own dynamics: an autoregression ``D(q^-1) e(t) = w(t)``, w white.

An output-error model explains y by u alone. What it leaves is coloured: the load's slow changes, shaped by the drive.
Burg's method (J. P. Burg, 1967; S. M. Kay, Modern Spectral Estimation, chapter 7) finds D one reflection coefficient
at a time from the forward error f and the backward error g::

    k_m = - 2 sum f_(m-1)(t) g_(m-1)(t-1) / sum (f_(m-1)(t)^2 + g_(m-1)(t-1)^2)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from estimator.signals.record import BoolArray, FloatArray

MEMORY_S = 1.0
"""Reach of the autoregression [s]: a driver answers the speed after 0.3 to 1 s, and what a noise model does not reach
is left to the response. On 200 buses in closed loop (``python -m tests.benchmarks.identification``) intervals of J_M
and k hold 97 and 96 % of the truths; on forty of them, reaching half as far, 90 and 85 %."""

SAMPLES_PER_COEFFICIENT = 10
"""Terms of the sums asked for per coefficient; where masks leave fewer, the order ends there."""


@dataclass(frozen=True, slots=True, eq=False)
class NoiseModel:
    """The autoregression of a residual."""

    D: FloatArray  # (p+1,): coefficients in q^-1, leading 1; ``[1]`` for white noise
    std: float  # standard deviation of w [output unit]

    @property
    def order(self) -> int:
        """Number of past residuals that tell of the next."""
        return int(self.D.shape[0]) - 1

    def whiten(self, x: FloatArray) -> FloatArray:
        """Return D x; the first p values lack a past."""
        return np.asarray(lfilter(self.D, [1.0], x, axis=0), dtype=np.float64)

    def complete(self, okay: BoolArray) -> BoolArray:
        """Tell which samples and all p before them are good, shape (N,)."""
        counts = np.concatenate([[0], np.cumsum(okay)])
        good: BoolArray = np.zeros(okay.shape, dtype=np.bool_)
        reach = self.order + 1
        good[reach - 1 :] = counts[reach:] - counts[:-reach] == reach
        return good

    def coloured_backwards(self, psi: FloatArray) -> FloatArray:
        """Return ``sum_i h_i psi(t+i)`` along the first axis, with h the impulse response of 1 / D."""
        return np.asarray(lfilter([1.0], self.D, psi[::-1], axis=0)[::-1], dtype=np.float64)

    def spectrum(self, frequency_hz: FloatArray, sample_time_s: float) -> FloatArray:
        """Return the spectral density of e, one-sided [output unit squared per Hz]."""
        q = np.exp(-2j * np.pi * frequency_hz * sample_time_s)
        density = 2.0 * self.std**2 * sample_time_s / np.abs(np.polynomial.polynomial.polyval(q, self.D)) ** 2
        return np.asarray(density, dtype=np.float64)


def white(e: FloatArray, okay: BoolArray) -> NoiseModel:
    """Return the model of a residual without memory."""
    return NoiseModel(np.ones(1), float(np.sqrt(np.mean(e[okay] ** 2))) if okay.any() else 0.0)


def reach(sample_time_s: float) -> int:
    """Return the order that spans the memory asked for at a sampling period [s]."""
    return max(round(MEMORY_S / sample_time_s), 1)


def fit_noise(e: FloatArray, okay: BoolArray, order: int) -> NoiseModel:
    """Fit the autoregression of a residual by Burg's method."""
    forward = np.where(okay, e, 0.0)
    backward, valid = forward.copy(), okay.copy()
    D, power = np.ones(1), float(np.mean(forward[okay] ** 2)) if okay.any() else 0.0
    for m in range(1, order + 1):
        valid = valid[1:] & okay[: okay.shape[0] - m]
        ahead, behind = forward[1:], backward[:-1]
        f, g = ahead[valid], behind[valid]
        energy = float(f @ f + g @ g)
        if f.shape[0] < SAMPLES_PER_COEFFICIENT * m or energy <= 0.0:
            break
        k = -2.0 * float(f @ g) / energy
        forward, backward = ahead + k * behind, behind + k * ahead
        D = np.concatenate([D, [0.0]]) + k * np.concatenate([[0.0], D[::-1]])
        power *= 1.0 - k * k
    return NoiseModel(D, float(np.sqrt(power)))


def sandwich(gradient: FloatArray, okay: BoolArray, noise: NoiseModel) -> FloatArray:
    """Return the covariance of all parameters of a least-squares fit, shape (n, n)."""
    psi = np.where(okay[:, np.newaxis], gradient, 0.0)
    n_samples = int(np.count_nonzero(okay))
    spent = psi.shape[1] + noise.order
    bread = np.linalg.pinv(psi.T @ psi, hermitian=True)
    psi_h = noise.coloured_backwards(psi)
    scale = noise.std**2 * n_samples / max(n_samples - spent, 1)
    return np.asarray(scale * bread @ (psi_h.T @ psi_h) @ bread, dtype=np.float64)
