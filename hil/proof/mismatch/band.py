"""At which frequencies a mismatch is, and how a band that was reported stands to the true one.

A band holds the central part of a mismatch's power, as ``mismatch.band_hz`` of ``diagnosis.json`` (CONTRACT): a tenth
of it is below and a tenth above. The density is Welch's average (IEEE Trans. Audio Electroacoust. 15, 1967) over all
recordings. Widths are compared on a linear axis, and a band reaches half a step of frequency beyond its outermost ones:
an average over segments resolves the same number of hertz everywhere. On a logarithmic axis most of a slow band's width
would be what lies below that step, which no one has resolved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import signal

from hil.proof.truth.experiments import PERIOD_S
from hil.proof.truth.physics import FloatArray

CENTRAL = 0.8
"""Share of the power that a band holds."""

SEGMENT = 512
"""Samples of a segment: 5 s, which resolves 0.2 Hz and leaves ten of them, half overlapping, in a recording of 30 s."""

MOST_OF_POWER = 0.5
"""A band is right only if more of the mismatch is in it than outside,"""

MOST_OF_WIDTH = 0.5
"""and if both bands share half of the wider: neither is over twice as wide, nor moved by more than half a width."""

Band = tuple[float, float]
"""Lowest and highest frequency [Hz]."""


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Density of a mismatch's power.

    Attributes
    ----------
    frequency_hz : ndarray, shape (F,)
        Evenly spaced from 0.
    density : ndarray, shape (F,)
        [rad^2/s^2/Hz], summed over the recordings.
    """

    frequency_hz: FloatArray
    density: FloatArray

    @property
    def step_hz(self) -> float:
        """Distance of the frequencies."""
        return float(self.frequency_hz[1])

    def band_hz(self) -> Band:
        """Return the band that holds the central part of the power."""
        share = np.cumsum(self.density) / np.sum(self.density)
        tail = 0.5 * (1.0 - CENTRAL)
        low, high = np.searchsorted(share, [tail, 1.0 - tail])
        return float(self.frequency_hz[low]), float(self.frequency_hz[high])

    def share_in(self, band: Band) -> float:
        """Return the share of the power that lies in a band."""
        half = 0.5 * self.step_hz
        inside = (self.frequency_hz > band[0] - half) & (self.frequency_hz < band[1] + half)
        return float(np.sum(self.density[inside]) / np.sum(self.density))


@dataclass(frozen=True, slots=True)
class BandScore:
    """How a band that was reported stands to the true one.

    Attributes
    ----------
    told_hz, true_hz : tuple of float
    power_share : float
        Share of the true mismatch's power that is in the reported band; in the true one it is `CENTRAL`.
    width_ratio : float
        Width of the reported band over that of the true one.
    overlap : float
        Width that both share, over that of the wider.
    """

    told_hz: Band
    true_hz: Band
    power_share: float
    width_ratio: float
    overlap: float

    @property
    def right(self) -> bool:
        """Whether the reported band is where the mismatch is, and is not there by being everywhere."""
        return self.power_share >= MOST_OF_POWER and self.overlap >= MOST_OF_WIDTH


def spectrum_of(rests_rad_s: Sequence[FloatArray]) -> Spectrum:
    """Return the spectrum of what is left of recordings, which are as long as each other [rad/s], shape (N,) each."""
    totals = [signal.welch(rest, 1.0 / PERIOD_S, nperseg=min(SEGMENT, rest.size)) for rest in rests_rad_s]
    return Spectrum(totals[0][0], np.sum([density for _, density in totals], axis=0))


def compare(told_hz: Band, true: Spectrum) -> BandScore:
    """Compare a band that was reported with a true mismatch."""
    step, true_hz = true.step_hz, true.band_hz()
    reported_width, true_width = (high - low + step for low, high in (told_hz, true_hz))
    shared = min(told_hz[1], true_hz[1]) - max(told_hz[0], true_hz[0]) + step
    return BandScore(
        told_hz=told_hz,
        true_hz=true_hz,
        power_share=true.share_in(told_hz),
        width_ratio=reported_width / true_width,
        overlap=max(0.0, shared) / max(reported_width, true_width),
    )
