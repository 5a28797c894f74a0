"""Local polynomial method: the transient of the free motion is estimated with the response, not averaged away.

The discrete Fourier transforms of *one* long stretch obey (R. Pintelon and J. Schoukens, System Identification: A
Frequency Domain Approach, 2nd ed., chapter 7)::

    Y(k) = G(k) U(k) + T(k) + V(k)

with T the transform of begin and end of the stretch: leakage. G and T are smooth in frequency, U is not, so that
around each line k over the 2n + 1 neighbours r = -n .. n both are polynomials of degree R, solved by least squares::

    Y(k+r) = U(k+r) (G + g_1 r + .. + g_R r^R) + (T + t_1 r + .. + t_R r^R) + V(k+r)
    var V  = sum |residual|^2 / (2n + 1 - 2 (R + 1)),      var G = var V [(K^H K)^-1]_11

No window, hence the resolution of the whole stretch, and a noise variance free of leakage. It serves where a resonance
is so sharp that segments blur it, or the recording is short.
"""

import numpy as np

from estimator.errors import NotExciting
from estimator.identification.linear_model import ComplexArray
from estimator.identification.spectral import SpectralEstimate
from estimator.signals.record import BoolArray, FloatArray, Record
from estimator.signals.settings import Requirement, require

DEGREE = 2
"""R. The usual choice: odd terms cancel at the middle line, so the bias is that of a fourth-order term."""


def local_polynomial(record: Record, half_width: int = 6, degree: int = DEGREE) -> SpectralEstimate:
    """Estimate the transfer function from total torque to output with the transient taken out."""
    columns, width = 2 * (degree + 1), 2 * half_width + 1
    require(
        "local polynomial estimate",
        (
            Requirement("degree", degree, degree >= 0, "0 or more"),
            Requirement("half_width", half_width, width > columns, f"{columns // 2} or more for degree {degree}"),
        ),
    )
    begin, end = longest_stretch(record.okay)
    lines = (end - begin) // 2
    if lines < width:
        raise NotExciting(
            f"recording {record.name}: the longest stretch without masked samples has {end - begin} samples and so "
            f"{lines} lines, expected {width} lines or more. Record longer, mask less or take fewer neighbours.",
            ("frequency response",),
        )
    u = np.fft.rfft(record.total_torque_nm[begin:end])[1 : lines + 1]
    y = np.fft.rfft(record.output[begin:end])[1 : lines + 1]
    frequency_hz = np.arange(1, lines + 1) / ((end - begin) * record.sample_time_s)
    return _estimate(frequency_hz, u, y, half_width, degree)


def longest_stretch(okay: BoolArray) -> tuple[int, int]:
    """Return first and one past the last sample of the longest run of good ones; (0, 0) if there is none."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], okay, [False]]).astype(np.int8)))
    starts, ends = edges[::2], edges[1::2]
    if not starts.size:
        return 0, 0
    longest = int(np.argmax(ends - starts))
    return int(starts[longest]), int(ends[longest])


def _estimate(
    frequency_hz: FloatArray, u: ComplexArray, y: ComplexArray, half_width: int, degree: int
) -> SpectralEstimate:
    """Fit around every line; near either end of the band the neighbours lie to one side."""
    n_lines, width = u.shape[0], 2 * half_width + 1
    first = np.clip(np.arange(n_lines) - half_width, 0, n_lines - width)
    around = first[:, np.newaxis] + np.arange(width)
    r = (around - np.arange(n_lines)[:, np.newaxis]) / half_width
    powers = r[:, :, np.newaxis] ** np.arange(degree + 1)
    scale = np.sqrt(np.mean(np.abs(u[around]) ** 2, axis=1, keepdims=True)) + np.finfo(np.float64).tiny
    u_here = (u[around] / scale)[:, :, np.newaxis]
    K = np.concatenate([u_here * powers, powers.astype(np.complex128)], axis=2)
    inverse = np.linalg.pinv(K)
    theta = (inverse @ y[around][:, :, np.newaxis])[:, :, 0]
    residual = y[around] - (K @ theta[:, :, np.newaxis])[:, :, 0]
    freedom = width - 2 * (degree + 1)
    noise = np.sum(np.abs(residual) ** 2, axis=1) / freedom
    spread = np.sum(np.abs(inverse[:, 0, :]) ** 2, axis=1)
    G = theta[:, 0] / scale[:, 0]
    explained = np.abs(G) ** 2 * np.mean(np.abs(u[around]) ** 2, axis=1)
    coherence = explained / np.maximum(explained + noise, np.finfo(np.float64).tiny)
    std = np.where(coherence > 0.0, np.sqrt(0.5 * noise * spread) / scale[:, 0], np.inf)
    averages = float(np.median(1.0 / np.maximum(spread, np.finfo(np.float64).tiny)))
    return SpectralEstimate(frequency_hz, G, coherence, std, averages)
