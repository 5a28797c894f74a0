"""What every spectral estimator returns: a transfer function by frequency with confidence and coherence."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from scipy.stats import t as student

from estimator.identification.linear_model import ComplexArray
from estimator.signals.record import FloatArray


class SpectralMethod(Enum):
    """Spectral estimators; the value is the name in reports."""

    WELCH = "welch"


@dataclass(frozen=True, slots=True, eq=False)
class SpectralEstimate:
    """Transfer function by frequency; all arrays of shape (M,), frequency 0 left out.

    Attributes
    ----------
    frequency_hz : ndarray
    response : ndarray of complex
        Output unit per input unit.
    coherence : ndarray
        0 to 1: the part of the output's power that the input explains, at the resolution of the method.
    magnitude_std : ndarray
        Standard deviation of ``|response|``; infinite where the coherence is 0. Divided by the magnitude, that of the
        phase [rad].
    n_averages : float
        Independent averages behind each value.
    method : SpectralMethod
    freedom : float
        Degrees of freedom the standard deviation was estimated with: few where it comes from few periods.
    used_samples, bridged_samples : int
        Samples inside the segments, and how many of the recording were missing and bridged; 0 where not counted.
    """

    frequency_hz: FloatArray
    response: ComplexArray
    coherence: FloatArray
    magnitude_std: FloatArray
    n_averages: float
    method: SpectralMethod = SpectralMethod.WELCH
    freedom: float = math.inf
    used_samples: int = 0
    bridged_samples: int = 0

    def magnitude_interval(self, confidence: float = 0.95) -> tuple[FloatArray, FloatArray]:
        """Return the ends of the interval of ``|response|``, each of shape (M,); by Student's t, and not below 0."""
        reach = float(student.ppf(0.5 + confidence / 2.0, self.freedom)) * self.magnitude_std
        magnitude = np.abs(self.response)
        return np.maximum(magnitude - reach, 0.0), magnitude + reach


def from_spectra(
    frequency_hz: FloatArray,
    s_yu: ComplexArray,
    s_uu: FloatArray,
    s_yy: FloatArray,
    n_averages: float,
    method: SpectralMethod,
) -> SpectralEstimate:
    """Return the estimate of averaged spectra.

    Random error of the magnitude (J. S. Bendat and A. G. Piersol, Random Data, chapter "Statistical errors in advanced
    estimates"), for n_d independent averages; the same number, in radians, is that of the phase::

        std|G| / |G| = sqrt((1 - coherence) / (2 n_d coherence))

    Parameters
    ----------
    frequency_hz : ndarray, shape (M,)
    s_yu, s_uu, s_yy : ndarray, shape (M,)
        In any one unit per frequency.
    n_averages : float
        n_d.
    method : SpectralMethod
    """
    tiny = np.finfo(np.float64).tiny
    response = s_yu / np.maximum(s_uu, tiny)
    coherence = np.minimum(np.abs(s_yu) ** 2 / np.maximum(s_uu * s_yy, tiny), 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        std = np.abs(response) * np.sqrt((1.0 - coherence) / (2.0 * n_averages * coherence))
    std[coherence == 0.0] = np.inf
    return SpectralEstimate(frequency_hz, response, coherence, std, float(n_averages), method)
