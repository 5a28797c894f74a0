"""Spectral transfer-function estimate: what the data say without a model, to hold the models against.

Welch's averaged cross-spectra with a Hann window and half overlap (P. D. Welch, IEEE Trans. Audio and
Electroacoustics 15, 1967)::

    G(f) = S_yu(f) / S_uu(f),        coherence(f) = |S_yu|^2 / (S_uu S_yy)

Half-overlapping Hann segments are not independent; Welch's formula gives ``n_d = K / (1 + 2 rho^2 (K-1)/K)``
for K of them, with rho = 1/6 the correlation of the window with itself half its length on.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import get_window

from estimator.errors import NotExciting
from estimator.identification.linear_model import ComplexArray
from estimator.identification.spectral.estimate import SpectralEstimate, SpectralMethod, from_spectra
from estimator.signals.record import BoolArray, FloatArray, Record
from estimator.signals.settings import Requirement, require

__all__ = ["SpectralEstimate", "good_segments", "spectral_estimate"]

HANN_OVERLAP_CORRELATION = 1.0 / 6.0
"""sum w(t) w(t + n/2) / sum w(t)^2 of a Hann window of n samples: (1/16) / (3/8)."""

FEWEST_SEGMENTS = 3
"""Fewer segments than this say nothing of the coherence: that of a single one is 1 whatever the data."""


def good_segments(okay: BoolArray, length: int) -> list[int]:
    """Return the starts of the half-overlapping segments that hold no masked sample."""
    return [s for s in range(0, okay.shape[0] - length + 1, length // 2) if okay[s : s + length].all()]


def spectral_estimate(record: Record, segment_samples: int = 256) -> SpectralEstimate:
    """Estimate the transfer function from total torque to output.

    Parameters
    ----------
    record : Record
        With the slow part removed.
    segment_samples : int
        Length of a segment; the frequencies are 1 / (length * sampling period) apart.

    Raises
    ------
    BadSetting
        If a segment is shorter than 8 samples.
    NotExciting
        If the mask leaves fewer than three unbroken segments.
    """
    require(
        "spectral estimate",
        (Requirement("segment_samples", segment_samples, segment_samples >= 8, "8 or more samples"),),
    )
    starts = good_segments(record.okay, segment_samples)
    if len(starts) < FEWEST_SEGMENTS:
        raise NotExciting(
            f"recording {record.name}: {len(starts)} unbroken segments of {segment_samples} samples, "
            f"expected {FEWEST_SEGMENTS} or more. Record longer or take shorter segments.",
            ("frequency response",),
        )
    u = _spectra(record.total_torque_nm, starts, segment_samples)
    y = _spectra(record.output, starts, segment_samples)
    return _estimate(u, y, segment_samples, record.sample_time_s)


def _spectra(x: FloatArray, starts: list[int], length: int) -> ComplexArray:
    """Return the windowed Fourier transform of each segment, shape (K, M), frequency 0 left out."""
    window = get_window("hann", length)
    segments = np.stack([x[s : s + length] for s in starts])
    centred = segments - segments.mean(axis=1, keepdims=True)
    return np.asarray(np.fft.rfft(centred * window, axis=1)[:, 1:], dtype=np.complex128)


def _estimate(u: ComplexArray, y: ComplexArray, length: int, sample_time_s: float) -> SpectralEstimate:
    s_uu, s_yy = np.mean(np.abs(u) ** 2, axis=0), np.mean(np.abs(y) ** 2, axis=0)
    s_yu = np.mean(y * np.conj(u), axis=0)
    k = u.shape[0]
    n_averages = k / (1.0 + 2.0 * HANN_OVERLAP_CORRELATION**2 * (k - 1) / k)
    frequency_hz = np.fft.rfftfreq(length, sample_time_s)[1:].astype(np.float64)
    return from_spectra(frequency_hz, s_yu, s_uu, s_yy, n_averages, SpectralMethod.WELCH)
