"""The error over frequency, against the noise floor."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy import signal, stats

from estimator.diagnosis.result import BandTest, ErrorSpectrum
from estimator.physics.fit import FitResult
from estimator.signals.record import FloatArray, Record

SEGMENT = 256
"""Samples of a segment: 2.56 s at 10 ms, long enough to resolve a driveline's first mode."""

FEWEST_PER_BAND = 3
"""Frequencies in a band at least."""


def error_spectrum(before: FitResult, after: FitResult, floor: float) -> ErrorSpectrum:
    """Return the density of the error of two fits of the same recordings, and where the first stands above the floor.

    Welch's average over all recordings of at least a segment, Hann window; each band of an octave is tested against
    white noise of the floor's size, corrected for the number of bands.
    """
    records = before.problem.records
    length = min(SEGMENT, *(record.okay.size for record in records))
    frequency, first, averages = _density(records, before.outputs, length)
    _, second, _ = _density(records, after.outputs, length)
    density = 2.0 * floor**2 * records[0].sample_time_s
    return ErrorSpectrum(
        frequency[1:],
        np.sqrt(first[1:]),
        np.sqrt(second[1:]),
        float(np.sqrt(density)),
        _bands(frequency[1:], first[1:] / density, averages),
    )


def _density(
    records: Sequence[Record], outputs: Sequence[FloatArray], length: int
) -> tuple[FloatArray, FloatArray, float]:
    """Return frequencies [Hz], mean density and the number of independent averages behind it."""
    total, weight = np.zeros(length // 2 + 1), 0.0
    frequency = np.fft.rfftfreq(length, records[0].sample_time_s).astype(np.float64)
    for record, output in zip(records, outputs, strict=True):
        error = np.where(record.okay, record.output - output, 0.0)
        _, density = signal.welch(error, 1.0 / record.sample_time_s, nperseg=length)
        segments = max(2.0 * error.size / length - 1.0, 1.0)
        total += segments * density * record.okay.size / max(int(record.okay.sum()), 1)
        weight += segments
    return frequency, total / weight, weight / (1.0 + 2.0 / 36.0)  # neighbours share half their samples (Welch)


def _bands(frequency: FloatArray, ratio: FloatArray, averages: float) -> tuple[BandTest, ...]:
    edges = _octaves(frequency)
    count = edges.size - 1
    found = []
    for low, high in pairwise(edges.tolist()):
        inside = (frequency >= low) & (frequency < high)
        mean = float(ratio[inside].mean())
        degrees = 2.0 * averages * float(inside.sum()) / 1.5  # a Hann window ties neighbouring frequencies together
        p_value = min(1.0, count * float(stats.chi2.sf(mean * degrees, degrees)))
        found.append(BandTest(float(low), float(high), mean, p_value))
    return tuple(found)


def _octaves(frequency: FloatArray) -> FloatArray:
    """Return band edges an octave apart, each band with a few frequencies; the last holds the highest."""
    edges = [float(frequency[-1]) * (1.0 + 1e-9)]
    step = float(frequency[1] - frequency[0])
    while 0.5 * edges[-1] >= max(float(frequency[0]), FEWEST_PER_BAND * step):
        edges.append(0.5 * edges[-1])
    return np.array([*edges, float(frequency[0])][::-1]) if edges[-1] > frequency[0] else np.array(edges[::-1])
