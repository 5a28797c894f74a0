"""Spectral transfer-function estimate: what the data say by frequency without a model, to hold the models against.

Welch's averaged cross-spectra with a Hann window and half overlap (P. D. Welch, IEEE Trans. Audio and
Electroacoustics 15, 1967)::

    G(f) = S_yu(f) / S_uu(f),        coherence(f) = |S_yu|^2 / (S_uu S_yy)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import get_window

from estimator.errors import NotExciting
from estimator.identification.linear_model import ComplexArray
from estimator.identification.offline.problem import gaps
from estimator.signals.decimate import Blocks, block_of
from estimator.signals.record import BoolArray, FloatArray, Record
from estimator.signals.settings import Requirement, require


@dataclass(frozen=True, slots=True, eq=False)
class SpectralEstimate:
    """Transfer function by frequency; all arrays of shape (M,), frequency 0 left out."""

    frequency_hz: FloatArray
    response: ComplexArray  # output unit per input unit
    coherence: FloatArray
    magnitude_std: FloatArray  # standard deviation of ``|response|``
    n_averages: float  # independent averages behind each value
    used_samples: int = 0
    bridged_samples: int = 0


def from_spectra(
    frequency_hz: FloatArray,
    s_yu: ComplexArray,
    s_uu: FloatArray,
    s_yy: FloatArray,
    n_averages: float,
) -> SpectralEstimate:
    """Return the estimate of averaged spectra."""
    tiny = np.finfo(np.float64).tiny
    response = s_yu / np.maximum(s_uu, tiny)
    coherence = np.minimum(np.abs(s_yu) ** 2 / np.maximum(s_uu * s_yy, tiny), 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        std = np.abs(response) * np.sqrt((1.0 - coherence) / (2.0 * n_averages * coherence))
    std[coherence == 0.0] = np.inf
    return SpectralEstimate(frequency_hz, response, coherence, std, float(n_averages))


__all__ = ["SpectralEstimate", "good_segments", "spectral_estimate"]

HANN_OVERLAP_CORRELATION = 1.0 / 6.0
"""sum w(t) w(t + n/2) / sum w(t)^2 of a Hann window of n samples: (1/16) / (3/8)."""

FEWEST_SEGMENTS = 3
"""Fewer segments than this say nothing of the coherence: that of a single one is 1 whatever the data."""


def good_segments(okay: BoolArray, length: int) -> list[int]:
    """Return the starts of the half-overlapping segments that hold no masked sample."""
    return [s for s in range(0, okay.shape[0] - length + 1, length // 2) if okay[s : s + length].all()]


SHORT_S = 0.03
"""Gaps up to this long are bridged by straight lines [s]: under a quarter of a period at 8 Hz, a resonance's."""

SHORTEST_S = 1.0
"""Segments are halved down to this length [s] where long gaps leave too few: below, a resonance is one line wide."""


def spectral_estimate(record: Record, segment_samples: int = 256) -> SpectralEstimate:
    """Estimate the transfer function from total torque to output.

    Short gaps are bridged, segments lie between long ones; they are halved until there are three of them. Samples
    faster than 10 ms are averaged in blocks first, which changes both spectra alike.
    """
    block = block_of(record.sample_time_s)
    period_s = block * record.sample_time_s
    length = segment_samples // block
    require(
        "spectral estimate",
        (Requirement("segment_samples", segment_samples, length >= 8, f"{8 * block} or more samples"),),
    )
    okay = record.okay if record.read is None else record.okay & record.read
    usable, bridged = _bridged_mask(okay, SHORT_S / record.sample_time_s)
    blocks = Blocks(usable, block)
    starts = good_segments(blocks.okay, length)
    while len(starts) < FEWEST_SEGMENTS and length * period_s / 2.0 >= SHORTEST_S:
        length //= 2
        starts = good_segments(blocks.okay, length)
    if len(starts) < FEWEST_SEGMENTS:
        raise NotExciting(
            f"recording {record.name}: {len(starts)} unbroken segments of {length * period_s:.3g} s, expected "
            f"{FEWEST_SEGMENTS} or more. Record longer, or with fewer long gaps.",
            ("frequency response",),
        )
    signals = (blocks.mean(_bridge(x, okay)) for x in (record.total_torque_nm, record.output))
    u, y = (_spectra(x, starts, length) for x in signals)
    covered = np.zeros(blocks.okay.shape, dtype=np.bool_)
    for start in starts:
        covered[start : start + length] = True
    estimate = _estimate(u, y, length, period_s)
    return replace(estimate, used_samples=int(covered.sum()) * block, bridged_samples=bridged)


def _bridged_mask(okay: BoolArray, longest: float) -> tuple[BoolArray, int]:
    """Return where samples are measured or in a gap of at most so many, and how many are in such gaps."""
    usable = okay.copy()
    for start, end in gaps(okay):
        if end - start <= longest and 0 < start and end < okay.shape[0]:
            usable[start:end] = True
    return usable, int(np.count_nonzero(usable & ~okay))


def _bridge(x: FloatArray, okay: BoolArray) -> FloatArray:
    rows = np.arange(x.shape[0])
    return np.asarray(np.interp(rows, rows[okay], x[okay]), dtype=np.float64)


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
    return from_spectra(frequency_hz, s_yu, s_uu, s_yy, n_averages)
