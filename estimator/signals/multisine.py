"""Multi-sine: a periodic torque with power at chosen lines of its spectrum, and at no other.

A response at its lines is that of the line; what is between them is noise, and what is at lines that were left out on
purpose is distortion: even lines where all lines are odd, and one odd line in each group of four (random odd-odd
multi-sine; Pintelon and Schoukens, System Identification, 2nd ed., 2012, ch. 4).
"""

from __future__ import annotations

from enum import Enum

import numpy as np
from numpy.typing import NDArray

from estimator.signals.record import FloatArray, IntArray
from estimator.signals.settings import Requirement, is_positive, require

GROUP = 4  # odd lines in a group of which one, drawn at random, is left out to detect odd distortion
FEWEST_LINES = 2  # with fewer it is a sine

ROUNDS = 400
"""Rounds of clipping at most (Van der Ouderaa, Schoukens and Renneboog, IEEE Trans. Instrum. Meas. 37, 1988)."""

CLIP = 0.95  # share of the peak at which a round clips, at first; it rises to 1


class Lines(Enum):
    """Which lines of the spectrum carry power."""

    FULL = "full"
    ODD = "odd"
    ODD_RANDOM = "odd_random"


def excited_lines(
    period_samples: int, sample_time_s: float, lowest_hz: float, highest_hz: float, lines: Lines, seed: int
) -> IntArray:
    """Return the lines that carry power, as multiples of the fundamental, shape (F,)."""
    base_hz = 1.0 / (period_samples * sample_time_s)
    first, last = int(np.ceil(lowest_hz / base_hz - 1e-9)), int(np.floor(highest_hz / base_hz + 1e-9))
    every = np.arange(max(first, 1), min(last, (period_samples - 1) // 2) + 1)
    if lines is Lines.FULL:
        return every
    odd: IntArray = every[every % 2 == 1]
    if lines is Lines.ODD:
        return odd
    rng = np.random.default_rng(seed)
    groups = [odd[i : i + GROUP] for i in range(0, odd.size, GROUP)]
    left_out = [rng.integers(GROUP) for _ in groups]
    return np.concatenate(
        [np.delete(g, out) if g.size == GROUP else g for g, out in zip(groups, left_out, strict=True)]
    )


def multisine_nm(period_samples: int, excited: IntArray, amplitude_nm: float) -> FloatArray:
    """Return one period with equal power at every line and phases that make its peak small."""
    require(
        "multi-sine",
        (
            Requirement("amplitude_nm", amplitude_nm, is_positive(amplitude_nm), "a torque above 0 Nm"),
            Requirement("lines", excited.size, excited.size >= FEWEST_LINES, "two or more lines"),
        ),
    )
    phases = -np.pi * np.arange(excited.size) * (np.arange(excited.size) - 1) / excited.size  # Schroeder, 1970
    spectrum: NDArray[np.complex128] = np.zeros(period_samples // 2 + 1, dtype=np.complex128)
    spectrum[excited] = np.exp(1j * phases)
    signal, best = np.fft.irfft(spectrum, period_samples), np.inf
    chosen = signal
    for i in range(ROUNDS):
        crest = float(np.abs(signal).max() / np.sqrt(np.mean(signal**2)))
        if crest < best:
            chosen, best = signal, crest
        level = (CLIP + (1.0 - CLIP) * i / ROUNDS) * float(np.abs(signal).max())
        clipped = np.fft.rfft(np.clip(signal, -level, level))
        spectrum[excited] = np.exp(1j * np.angle(clipped[excited]))
        signal = np.fft.irfft(spectrum, period_samples)
    return chosen * (amplitude_nm / float(np.abs(chosen).max()))


def crest_factor(signal: FloatArray) -> float:
    """Return peak over RMS."""
    return float(np.abs(signal).max() / np.sqrt(np.mean(signal**2)))


class Multisine:
    """A period over and over, one level per cycle; the same interface as `prbs.Prbs`."""

    __slots__ = ("_at", "_period_nm")

    def __init__(self, period_nm: FloatArray) -> None:
        self._period_nm = period_nm
        self._at = 0

    def next(self) -> float:
        """Return the level of this cycle [Nm] and continue to the next cycle."""
        level_nm = float(self._period_nm[self._at])
        self._at = (self._at + 1) % self._period_nm.size
        return level_nm
