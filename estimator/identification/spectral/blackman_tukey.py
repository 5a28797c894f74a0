"""Blackman-Tukey estimate: correlations up to a lag, windowed, then transformed.

::

    G(f) = S_yu(f) / S_uu(f),      S_xz(f) = sum over |tau| <= M of w(tau) R_xz(tau) exp(-2 pi i f tau T)
    R_xz(tau) = (1 - |tau| / N) * sum of x(t + tau) z(t) over good pairs / number of good pairs

(R. B. Blackman and J. W. Tukey, 1958; L. Ljung, System Identification, 2nd ed., section 6.4). Every pair of good
samples counts, so gaps need no unbroken segments, unlike Welch's method. The window is Parzen's, whose transform is
nowhere negative, so that no power is; its bandwidth gives ``n_d = N / (M 0.539)`` independent averages, 0.539 M the
sum of its squares over all lags (Ljung, table 6.1).

Over gaps the correlations do not belong to one signal and a power may come out below 0; it counts as 0, coherence 0.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import fftconvolve
from scipy.signal.windows import parzen

from estimator.errors import NotExciting
from estimator.identification.spectral.estimate import SpectralEstimate, SpectralMethod, from_spectra
from estimator.signals.record import BoolArray, FloatArray, Record
from estimator.signals.settings import Requirement, require

PARZEN_SQUARES = 0.539
"""Sum of the squares of Parzen's window over lags -M to M, divided by M: 151 / 280."""

SHARE_OF_PAIRS = 0.05
"""Share of all samples that must remain as pairs at every lag."""


def blackman_tukey(record: Record, most_lags: int = 256, n_frequencies: int = 256) -> SpectralEstimate:
    """Estimate the transfer function from total torque to output from windowed correlations.

    Parameters
    ----------
    record : Record
        With the slow part removed.
    most_lags : int
        M: more resolve finer, 1.9 / (M T) hertz, and scatter more.
    n_frequencies : int
        Frequencies up to half the sampling frequency, evenly spaced.

    Raises
    ------
    BadSetting
        If M is below 4 or there is no frequency.
    NotExciting
        If the recording is shorter than 4 M, or the mask leaves too few pairs at some lag.
    """
    require(
        "Blackman-Tukey estimate",
        (
            Requirement("most_lags", most_lags, most_lags >= 4, "4 or more samples"),
            Requirement("n_frequencies", n_frequencies, n_frequencies >= 1, "1 or more"),
        ),
    )
    u, y, okay = record.total_torque_nm, record.output, record.okay
    good = okay.astype(np.float64)
    pairs = np.rint(_correlation(good, good, most_lags))
    if u.shape[0] < 4 * most_lags or pairs.min() < SHARE_OF_PAIRS * u.shape[0]:
        raise NotExciting(
            f"recording {record.name}: {u.shape[0]} samples with as few as {pairs.min():.0f} good pairs at a lag up to "
            f"{most_lags}, expected {4 * most_lags} samples and pairs of {SHARE_OF_PAIRS:.0%} of them at every lag. "
            "Record longer, mask less or take fewer lags.",
            ("frequency response",),
        )
    u, y = _centred(u, okay), _centred(y, okay)
    frequency_hz = np.arange(1, n_frequencies + 1) / (2.0 * n_frequencies * record.sample_time_s)
    overlap = 1.0 - np.abs(np.arange(-most_lags, most_lags + 1)) / u.shape[0]
    window = parzen(2 * most_lags + 1) * overlap / pairs
    turn = np.exp(-2j * np.pi * np.outer(frequency_hz * record.sample_time_s, np.arange(-most_lags, most_lags + 1)))
    s_yu, s_uu, s_yy = (turn @ (window * _correlation(x, z, most_lags)) for x, z in ((y, u), (u, u), (y, y)))
    n_averages = float(np.count_nonzero(okay)) / (PARZEN_SQUARES * most_lags)
    p_u, p_y = np.maximum(s_uu.real, 0.0), np.maximum(s_yy.real, 0.0)
    return from_spectra(frequency_hz, s_yu, p_u, p_y, n_averages, SpectralMethod.BLACKMAN_TUKEY)


def _centred(x: FloatArray, okay: BoolArray) -> FloatArray:
    """Return x less its mean, 0 where masked."""
    return np.where(okay, x - x[okay].mean(), 0.0)


def _correlation(x: FloatArray, z: FloatArray, most_lags: int) -> FloatArray:
    """Return sum of x(t + tau) z(t) for tau from -M to M, shape (2M+1,)."""
    middle = x.shape[0] - 1
    return np.asarray(fftconvolve(x, z[::-1])[middle - most_lags : middle + most_lags + 1], dtype=np.float64)
