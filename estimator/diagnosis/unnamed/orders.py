"""Order analysis: which waves over the motor's angle a signal holds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import find_peaks

from estimator.signals.record import FloatArray

HIGHEST_ORDER = 24.0
"""Periods per motor turn: faster ones pass unseen through any driveline."""

SLOWEST_WAVE = 3.0
"""Waves that fit into a recording at least."""

MOST_PEAKS = 3
"""Orders that are tried of the signal itself, and of its change, the strongest first."""

APART = 10.0
"""Orders that differ by less than this many waves in a recording are one: a wave that comes and goes is no line."""

BINS_PER_WAVE = 4.0

LONGEST_TRAVEL = 30_000.0
"""Angle of one spectrum [rad], some 5000 turns: its grid has a million places."""

FEWEST_SAMPLES = 1024
"""Samples in such a piece; with fewer its waves are not seen."""


def peaks(signals: Sequence[FloatArray], angles: Sequence[FloatArray]) -> FloatArray:
    """Return the orders at which signals of recordings have most power over the angle, strongest first."""
    width = 2.0 * np.pi / (BINS_PER_WAVE * HIGHEST_ORDER)
    signals, angles = _pieces(signals, angles)
    if not angles:
        return np.zeros(0)
    travel = max(float(np.ptp(angle)) for angle in angles)
    if travel < 2.0 * np.pi * SLOWEST_WAVE / HIGHEST_ORDER:
        return np.zeros(0)
    size = 1 << int(np.ceil(np.log2(2.0 * travel / width)))
    orders = 2.0 * np.pi * np.arange(size // 2 + 1) / (size * width)
    good = (orders >= 2.0 * np.pi * SLOWEST_WAVE / travel) & (orders <= HIGHEST_ORDER)
    chosen: list[int] = []
    for prepare in (_centred, _steps):
        power = np.zeros(orders.size)
        for signal, angle in zip(signals, angles, strict=True):
            prepared = prepare(signal)
            place = ((angle - angle.min()) / width).astype(int)
            over_angle = np.bincount(place, prepared, size)
            power += np.abs(np.fft.rfft(over_angle)) ** 2 / max(float(prepared @ prepared), np.finfo(float).tiny)
        found, _ = find_peaks(np.where(good, power, 0.0))
        near = APART * 2.0 * np.pi / travel
        fresh: list[int] = []
        for i in found[np.argsort(-power[found])].tolist():
            if len(fresh) < MOST_PEAKS and all(abs(orders[i] - orders[j]) > near for j in [*chosen, *fresh]):
                fresh.append(i)
        chosen += fresh
    return np.asarray(orders[chosen])


def _pieces(
    signals: Sequence[FloatArray], angles: Sequence[FloatArray]
) -> tuple[Sequence[FloatArray], Sequence[FloatArray]]:
    """Cut recordings that travel further than `LONGEST_TRAVEL`, whose grid over the angle would have no bound.

    Pieces with too few samples for the waves in them are left out: all of them where the angle's unit is wrong.
    """
    if max(float(np.ptp(angle)) for angle in angles) <= LONGEST_TRAVEL:
        return signals, angles
    cut: tuple[list[FloatArray], list[FloatArray]] = ([], [])
    for signal, angle in zip(signals, angles, strict=True):
        place = np.floor((angle - angle.min()) / LONGEST_TRAVEL)
        for each in np.unique(place):
            inside = place == each
            if np.count_nonzero(inside) >= FEWEST_SAMPLES:
                cut[0].append(signal[inside])
                cut[1].append(angle[inside])
    return cut


def _centred(signal: FloatArray) -> FloatArray:
    centred: FloatArray = signal - signal.mean()
    return centred


def _steps(signal: FloatArray) -> FloatArray:
    """Return a signal's change from sample to sample: a slow drift is no longer the largest part."""
    return np.diff(signal, prepend=signal[0])
