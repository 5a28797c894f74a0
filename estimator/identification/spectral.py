"""Frequency response without a model, to hold the models against.

*Local rational method*, for any torque. The discrete Fourier transforms of one unbroken stretch obey (R. Pintelon and
J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012, chapter 7)::

    Y(k) = G(k) U(k) + T(k) + V(k)

with T the transform of begin and end of the stretch: leakage. U is not smooth in frequency; around each frequency G and
T are, but for a pole of the line nearby, which both have. Over 2n + 1 lines they are polynomials of degree R over one
pole in common, ``1 + p r``, found by least squares (T. McKelvey and G. Guérin, 16th IFAC Symposium on System
Identification, 2012)::

    Y(r) = U(r) (G + g_1 r + .. + g_R r^R) + (T + t_1 r + .. + t_R r^R) - p r Y(r) + V(r)
    var V = sum |residual|^2 / (2n + 1 - 2 (R + 1) - 1),      var G = var V [(K^H K)^-1]_11

There is no window, and a peak narrower than the 2n + 1 lines is not blurred: with polynomials alone its height was low
by up to 1.3 dB at a damping ratio of 0.027. Stretches between long gaps are averaged by their variances.

*Periodic torque* (ibid., chapters 3 and 4): at the lines of the period the response is that of the mean over the
periods, and its variance that of their scatter. Lines that carry no torque detect distortion: at even lines an even one
(a gap, an asymmetric friction), at odd lines that were left out an odd one (dry friction, saturation).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, t

from estimator.errors import NotExciting
from estimator.identification.linear_model import ComplexArray
from estimator.identification.offline.missing import gaps
from estimator.signals.decimate import Blocks, block_of
from estimator.signals.record import BoolArray, FloatArray, IntArray, Record

DEGREE = 2
"""R. The usual choice: odd terms cancel at the middle line, so that the bias is that of a fourth-order term."""

COLUMNS = 2 * (DEGREE + 1) + 1

HALF_WIDTH_HZ = 0.2
"""Half of what the polynomials span: the half-power band of a resonance of 8 Hz with 5 % damping is 0.8 Hz."""

FEWEST_NEIGHBOURS = 6
"""Lines to either side at least: of 13 lines 6 are left for the variance."""

SHORT_S = 0.03
"""Gaps up to this long are bridged by straight lines [s]: under a quarter of a period at 8 Hz, a resonance's."""

SHORTEST_S = 2.0
"""Shorter stretches have their 13 lines over more than 6 Hz."""

FEWEST_PERIODS = 4
"""The first is left out: it holds the transient."""

SHORTEST_PERIOD = 32
"""Samples: fewer lines than 15 say little of a response."""

PERIODIC_CORRELATION = 0.9
"""Correlation of a torque with itself a period later from which on it is called periodic."""

EXCITED = 0.05
"""Power of a line that carries torque, in parts of that of the strong ones."""

Z95 = 1.959963984540054

SMOOTHED = 5
"""Neighbouring lines whose noise is averaged: it is smooth in frequency."""


@dataclass(frozen=True, slots=True, eq=False)
class Distortion:
    """What a periodic torque leaves at lines that carry none; arrays of shape (K,).

    Attributes
    ----------
    frequency_hz : ndarray
    amplitude, noise : ndarray
        Of the output at each line, and the standard deviation that noise gives it [output unit].
    is_even : ndarray of bool
        Whether the line is an even multiple of the fundamental.
    """

    frequency_hz: FloatArray
    amplitude: FloatArray  # [output unit]
    noise: FloatArray
    is_even: BoolArray

    @property
    def noise_rms(self) -> float:
        """RMS amplitude that noise gives a line of the mean over the periods [output unit]."""
        return float(np.sqrt(2.0 * np.mean(self.noise**2)))

    def level(self, even: bool) -> tuple[float, float]:
        """Return the RMS amplitude beyond the noise at even or odd lines, and how probable it is by noise alone."""
        amplitude, noise = (each[self.is_even == even] for each in (self.amplitude, self.noise))
        if not amplitude.size:
            return float("nan"), float("nan")
        beyond = float(np.mean(amplitude**2 - 2.0 * noise**2))
        return float(np.sqrt(max(beyond, 0.0))), float(chi2.sf(np.sum((amplitude / noise) ** 2), 2 * amplitude.size))


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
        Of ``|response|``, such that 1.96 of it hold 95 %; infinite where the coherence is 0. Divided by the magnitude,
        that of the phase [rad].
    n_averages : float
        Independent averages behind each value.
    used_samples, bridged_samples : int
        Samples of the stretches, and how many of the recording were missing and bridged.
    distortion : Distortion or None
        Of a periodic torque that leaves lines out.
    """

    frequency_hz: FloatArray
    response: ComplexArray
    coherence: FloatArray
    magnitude_std: FloatArray
    n_averages: float
    used_samples: int = 0  # in all stretches
    bridged_samples: int = 0
    distortion: Distortion | None = None


@dataclass(frozen=True, slots=True, eq=False)
class _Local:
    """Estimate of one stretch: response, its variance, noise and explained power of the output per sample."""

    response: ComplexArray  # at each line [output unit per input unit]
    variance: FloatArray  # of the response
    noise: FloatArray  # power of the output that the input does not explain
    explained: FloatArray  # power that it explains
    freedom: int  # degrees of freedom of the variance


def spectral_estimate(record: Record, values_per_width: int = 1) -> SpectralEstimate:
    """Estimate the transfer function from total torque to output.

    Parameters
    ----------
    record : Record
        Without slow drift: high-passed or differenced. Samples faster than 10 ms are averaged in blocks first, which
        changes both spectra alike; short gaps are bridged.
    values_per_width : int
        Frequencies within the width of the polynomials; at 1 the values are independent of each other.
    """
    okay = record.okay if record.read is None else record.okay & record.read
    usable, bridged = _bridged_mask(okay, SHORT_S / record.sample_time_s)
    block = block_of(record.sample_time_s)
    blocks, period_s = Blocks(usable, block), block * record.sample_time_s
    u, y = (blocks.mean(_bridge(x, okay)) for x in (record.total_torque_nm, record.output))
    stretches = _stretches(blocks.okay, max(2 * (2 * FEWEST_NEIGHBOURS + 1), round(SHORTEST_S / period_s)))
    if not stretches:
        raise NotExciting(
            f"recording {record.name}: no unbroken stretch of {SHORTEST_S:g} s and of "
            f"{2 * (2 * FEWEST_NEIGHBOURS + 1) * period_s:.3g} s or more. Record longer, or with fewer long gaps.",
            ("frequency response",),
        )
    begin, end = max(stretches, key=lambda each: each[1] - each[0])
    period = _period(u[begin:end])
    if period is not None:
        return _periodic(u[begin:end], y[begin:end], period, period_s, block, bridged)
    duration_s = (end - begin) * period_s
    step_hz = (2 * _neighbours(duration_s) + 1) / duration_s / values_per_width
    frequency_hz: FloatArray = step_hz * np.arange(1, int(0.5 / period_s / step_hz) + 1, dtype=np.float64)
    parts = [_local(u[a:b], y[a:b], frequency_hz, period_s) for a, b in stretches]
    used = block * sum(b - a for a, b in stretches)
    return _averaged(frequency_hz, parts, [b - a for a, b in stretches], used, bridged)


def _bridged_mask(okay: BoolArray, longest: float) -> tuple[BoolArray, int]:
    """Return where samples are measured or in a gap of at most so many, and how many are in such gaps."""
    usable = okay.copy()
    for start, end in gaps(okay):
        if end - start <= longest and 0 < start and end < okay.shape[0]:
            usable[start:end] = True
    return usable, int(np.count_nonzero(usable & ~okay))


def _bridge(x: FloatArray, okay: BoolArray) -> FloatArray:
    rows = np.arange(x.shape[0])
    return np.asarray(np.interp(rows, rows[okay], x[okay]) if okay.any() else np.zeros(x.shape), dtype=np.float64)


def _stretches(okay: BoolArray, shortest: int) -> list[tuple[int, int]]:
    return [(a, b) for a, b in gaps(~okay) if b - a >= shortest]


def _neighbours(duration_s: float) -> int:
    return max(FEWEST_NEIGHBOURS, round(HALF_WIDTH_HZ * duration_s))


def _local(u: FloatArray, y: FloatArray, frequency_hz: FloatArray, period_s: float) -> _Local:
    """Fit polynomials and pole around each frequency; near either end of the band their lines lie to one side."""
    n = u.shape[0]
    half, lines = _neighbours(n * period_s), (n - 1) // 2
    half = min(half, (lines - 1) // 2)
    width = 2 * half + 1
    U, Y = (np.fft.rfft(x - x.mean())[1 : lines + 1] for x in (u, y))
    at = frequency_hz * n * period_s - 1.0
    first = np.clip(np.rint(at).astype(np.int64) - half, 0, lines - width)
    around = first[:, np.newaxis] + np.arange(width)
    powers = ((around - at[:, np.newaxis]) / half)[:, :, np.newaxis] ** np.arange(DEGREE + 1)
    scale = _size(U[around])
    pole = powers[:, :, 1:2] * (Y[around] / _size(Y[around]))[:, :, np.newaxis]
    K = np.concatenate([(U[around] / scale)[:, :, np.newaxis] * powers, powers.astype(np.complex128), pole], axis=2)
    KH = K.conj().transpose(0, 2, 1)
    inverse = np.linalg.pinv(KH @ K, hermitian=True)
    theta = (inverse @ (KH @ Y[around][:, :, np.newaxis]))[:, :, 0]
    residual = Y[around] - (K @ theta[:, :, np.newaxis])[:, :, 0]
    freedom = width - COLUMNS
    noise = np.sum(np.abs(residual) ** 2, axis=1) / freedom
    G = theta[:, 0] / scale[:, 0]
    variance = noise * inverse[:, 0, 0].real / scale[:, 0] ** 2
    variance[inverse[:, 0, 0].real <= 0.0] = np.inf
    return _Local(G, variance, noise / n, np.abs(theta[:, 0]) ** 2 / n, freedom)


def _size(X: ComplexArray) -> FloatArray:
    """Return the RMS magnitude of each row, shape (M, 1); never zero."""
    return np.asarray(np.sqrt(np.mean(np.abs(X) ** 2, axis=1, keepdims=True) + np.finfo(np.float64).tiny))


def _averaged(
    frequency_hz: FloatArray, parts: list[_Local], sizes: list[int], used: int, bridged: int
) -> SpectralEstimate:
    """Average stretches by their variances."""
    tiny = np.finfo(np.float64).tiny
    weights = np.array([1.0 / np.maximum(part.variance, tiny) for part in parts])
    total = np.maximum(weights.sum(axis=0), tiny)
    response = np.sum(weights / total * np.array([part.response for part in parts]), axis=0)
    noise, explained = (
        np.average([getattr(part, name) for part in parts], axis=0, weights=sizes) for name in ("noise", "explained")
    )
    coherence = explained / np.maximum(explained + noise, tiny)
    freedom = float(np.average([part.freedom for part in parts], weights=sizes)) * len(parts)
    std = np.where(coherence > 0.0, np.sqrt(0.5 / total) * _widening(freedom), np.inf)
    n_averages = float(sum(part.freedom + COLUMNS for part in parts))
    return SpectralEstimate(frequency_hz, response, coherence, std, n_averages, used, bridged)


def _widening(freedom: float) -> float:
    """Return by how much the quantile of a variance known from so many complex values exceeds the normal one."""
    return float(t.ppf(0.975, 2.0 * freedom)) / Z95


def _period(u: FloatArray) -> int | None:
    """Return the samples of a period of a torque that repeats itself often enough; None for any other.

    Judged by its changes: steps to and fro repeat themselves, too, but excite few lines; a PRBS on them excites all.
    """
    x = np.diff(u)
    n = x.shape[0]
    lags = np.arange(n // FEWEST_PERIODS + 1)
    power = np.concatenate([[0.0], np.cumsum(x**2)])
    overlap = np.fft.irfft(np.abs(np.fft.rfft(x, 2 * n)) ** 2)[: lags.size]
    size = np.sqrt(power[n - lags] * (power[n] - power[lags]))
    least = max(np.sqrt(np.finfo(np.float64).eps) * power[n], np.finfo(np.float64).tiny)  # rounding of the overlap
    correlation = overlap / np.maximum(size, least)
    below = np.flatnonzero(correlation < 0.5 * PERIODIC_CORRELATION)
    if not below.size or below[0] >= lags.size - 1:
        return None
    again = np.flatnonzero(correlation[below[0] :] >= PERIODIC_CORRELATION) + below[0]
    if not again.size:
        return None
    period = again[0] + int(np.argmax(correlation[again[0] : again[0] + below[0]]))
    period *= -(-SHORTEST_PERIOD // period)  # of a shorter one, several make one
    return int(period) if period * FEWEST_PERIODS <= n else None


def _periodic(u: FloatArray, y: FloatArray, period: int, period_s: float, block: int, bridged: int) -> SpectralEstimate:
    """Average the periods of a stretch, the first one left out."""
    count = u.shape[0] // period - 1
    rows = u.shape[0] - count * period
    U, Y = (np.fft.rfft(x[rows:].reshape(count, period))[:, 1 : (period + 1) // 2] for x in (u, y))
    mean_u, mean_y = U.mean(axis=0), Y.mean(axis=0)
    power = np.abs(mean_u) ** 2
    excited = power > EXCITED * np.quantile(power, 1.0 - min(0.5, 8.0 / power.size))
    line = np.arange(1, power.size + 1)
    G = mean_y[excited] / mean_u[excited]
    everywhere = np.interp(line, line[excited], G.real) + 1j * np.interp(line, line[excited], G.imag)
    scatter = np.abs(Y - mean_y - everywhere * (U - mean_u)) ** 2
    noise = _smoothed(scatter.sum(axis=0) / (count - 1))
    std = np.sqrt(0.5 * noise[excited] / count) / np.abs(mean_u[excited]) * _widening((count - 1) * SMOOTHED)
    explained = np.abs(mean_y[excited]) ** 2
    return SpectralEstimate(
        line[excited] / (period * period_s),
        G,
        explained / np.maximum(explained + noise[excited], np.finfo(np.float64).tiny),
        std,
        float(count),
        block * count * period,
        bridged,
        _distortion(line, excited, mean_y - everywhere * mean_u, noise / count, period, period_s),
    )


def _smoothed(noise: FloatArray) -> FloatArray:
    width = min(SMOOTHED, noise.size)
    padded = np.pad(noise, (width // 2, width - 1 - width // 2), mode="reflect" if noise.size > width else "edge")
    return np.convolve(padded, np.ones(width) / width, mode="valid")


def _distortion(
    line: IntArray, excited: BoolArray, left: ComplexArray, noise: FloatArray, period: int, period_s: float
) -> Distortion | None:
    """Return what is left between the first and the last excited line where no torque is."""
    silent = ~excited & (line > line[excited][0]) & (line < line[excited][-1])
    if 2 * int(silent.sum()) < int(excited.sum()):  # every line carries torque but for a few weak ones
        return None
    return Distortion(
        line[silent] / (period * period_s),
        2.0 / period * np.abs(left[silent]),
        2.0 / period * np.sqrt(0.5 * noise[silent]),
        line[silent] % 2 == 0,
    )
