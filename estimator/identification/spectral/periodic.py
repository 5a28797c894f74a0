"""Averages over whole periods of a periodic excitation: no leakage, and the noise is seen.

A PRBS repeats after 2^n - 1 of its steps: 1023 samples at 10 ms for the paper's ten cells. Once the free motion has
died away the response repeats too. Over a whole period the discrete Fourier transform has no leakage and needs no
window, and what differs between P periods is noise (R. Pintelon and J. Schoukens, System Identification: A Frequency
Domain Approach, 2nd ed., chapter 2)::

    U = mean of U_p,  Y = mean of Y_p,      G = Y / U
    var G = |G|^2 (var Y / |Y|^2 + var U / |U|^2 - 2 Re(cov(Y, U) / (Y conj(U))))
          = sum |Y_p - G U_p|^2 / (P (P - 1) |U|^2)

Only the lines of the sequence are estimated; between them there is nothing but noise. The coherence is that of an
average over the periods, ``1 / (1 + (P - 1) var G / |G|^2)`` with the bias of few periods in it.
"""

from __future__ import annotations

import numpy as np

from estimator.errors import NotExciting
from estimator.identification.linear_model import ComplexArray
from estimator.identification.spectral.estimate import SpectralEstimate, SpectralMethod
from estimator.signals.record import BoolArray, FloatArray, Record
from estimator.signals.settings import Requirement, require

FEWEST_PERIODS = 2
"""From one alone, noise can't be distinguished from response."""

EXCITED = 1e-3
"""Amplitude of a line, against the median line, from which on it counts as excited."""


def periodic_estimate(record: Record, period_samples: int) -> SpectralEstimate:
    """Estimate the transfer function from total torque to output at the lines of a periodic excitation.

    Parameters
    ----------
    record : Record
        With the slow part removed, at a period that divides that of the sequence: 1023 samples at 10 ms can't be
        decimated by 2.
    period_samples : int
        Period of the excitation [samples].

    Raises
    ------
    BadSetting
        If the period is shorter than 8 samples.
    NotExciting
        If the recording does not hold two unbroken periods.
    """
    require(
        "periodic estimate",
        (Requirement("period_samples", period_samples, period_samples >= 8, "8 or more samples"),),
    )
    starts = whole_periods(record.okay, period_samples)
    if len(starts) < FEWEST_PERIODS:
        raise NotExciting(
            f"recording {record.name}: {len(starts)} unbroken periods of {period_samples} samples, expected "
            f"{FEWEST_PERIODS} or more. Record longer, or take Welch's estimate, which needs no period.",
            ("frequency response",),
        )
    u = _transforms(record.total_torque_nm, starts, period_samples)
    y = _transforms(record.output, starts, period_samples)
    mean_u, mean_y = u.mean(axis=0), y.mean(axis=0)
    size = np.abs(mean_u)
    lines = size > EXCITED * np.median(size)
    if not lines.any():
        raise NotExciting(
            f"recording {record.name}: the torque has no line at a multiple of 1 / ({period_samples} samples), "
            "expected those of the PRBS. Check the period.",
            ("frequency response",),
        )
    n, G = len(starts), mean_y[lines] / mean_u[lines]
    scatter = np.sum(np.abs(y[:, lines] - G * u[:, lines]) ** 2, axis=0)
    variance = scatter / (n * (n - 1) * size[lines] ** 2)
    frequency_hz = np.fft.rfftfreq(period_samples, record.sample_time_s)[1:][lines]
    power = np.abs(G) ** 2
    coherence = power / np.maximum(power + (n - 1) * variance, np.finfo(np.float64).tiny)
    std = np.where(coherence > 0.0, np.sqrt(variance / 2.0), np.inf)
    return SpectralEstimate(frequency_hz, G, coherence, std, float(n), SpectralMethod.PERIODIC, 2.0 * (n - 1))


def whole_periods(okay: BoolArray, length: int) -> list[int]:
    """Return the starts of unbroken periods that do not overlap, in step with one another from the last sample back.

    Counted from the end, so that what is left over is the beginning, where the free motion is largest.
    """
    first = okay.shape[0] % length
    return [start for start in range(first, okay.shape[0], length) if okay[start : start + length].all()]


def _transforms(x: FloatArray, starts: list[int], length: int) -> ComplexArray:
    periods = np.stack([x[start : start + length] for start in starts])
    return np.asarray(np.fft.rfft(periods, axis=1)[:, 1:], dtype=np.complex128)
