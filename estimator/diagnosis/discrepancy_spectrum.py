"""The error over frequency: against the noise floor, and as a response against the spectral estimate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy import signal, stats

from estimator.diagnosis.intervals import Z95
from estimator.diagnosis.result import BandTest, ErrorSpectrum, Response
from estimator.errors import NotExciting
from estimator.identification.spectral import SpectralEstimate, spectral_estimate
from estimator.physics.fit import FitResult
from estimator.physics.model import Structure
from estimator.signals.record import FloatArray, Record

SEGMENT = 256
"""Samples of a segment: 2.56 s at 10 ms, long enough to resolve a driveline's first mode."""

FEWEST_PER_BAND = 3
"""Frequencies in a band at least."""

COHERENT = 0.5
"""Share of the output's power that the torque must explain before a response is compared there."""


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


def responses(before: FitResult, after: FitResult) -> dict[str, Response]:
    """Return the response of each recording and of both models in it; recordings too short or masked have none.

    Torque and output are differenced first: that changes no response, and a slow course of the speed does not leak. The
    models' responses are estimated from their simulations in the same way, so that what the method distorts is alike.
    A joint has none: its torque is the output.
    """
    found: dict[str, Response] = {}
    if before.problem.grid.structure is Structure.JOINT:
        return found
    for record, first, second in zip(before.problem.records, before.outputs, after.outputs, strict=True):
        try:
            measured = spectral_estimate(_differenced(record, record.output), SEGMENT)
        except NotExciting:  # not this recording: it is too short, or masked throughout
            continue
        simulated = [spectral_estimate(_differenced(record, output), SEGMENT) for output in (first, second)]
        found[record.name] = _response(measured, *simulated)
    return found


def _differenced(record: Record, output: FloatArray) -> Record:
    return replace(
        record,
        time_s=record.time_s[1:],
        torque_nm=np.diff(record.torque_nm, axis=0),
        output=np.diff(np.where(record.okay, output, 0.0)),
        okay=record.okay[1:] & record.okay[:-1],
        torque_okay=None,
        offset_s=None,
    )


def _response(measured: SpectralEstimate, before: SpectralEstimate, after: SpectralEstimate) -> Response:
    size, spread = np.abs(measured.response), Z95 * measured.magnitude_std
    return Response(
        measured.frequency_hz,
        size,
        np.maximum(size - spread, 0.0),
        size + spread,
        np.abs(before.response),
        np.abs(after.response),
        _p_value(measured, before),
        _p_value(measured, after),
    )


def _p_value(measured: SpectralEstimate, model: SpectralEstimate) -> float:
    """Return how probable so large a difference of two responses is by chance, where the estimate is coherent."""
    good = (measured.coherence > COHERENT) & (measured.coherence < 1.0)
    if not good.any():
        return 1.0
    apart = np.abs(measured.response - model.response)[good] / measured.magnitude_std[good]
    degrees = 2.0 * float(good.sum())
    return float(stats.chi2.sf(float(apart @ apart), degrees))
