"""Place of a mismatch in time, frequency and operating region."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy import signal, stats

from estimator.diagnosis.acquisition.finding import runs
from estimator.diagnosis.line.line import Motion, motion_of
from estimator.diagnosis.result import BandTest, ErrorSpectrum, Interval, Region, Response
from estimator.diagnosis.thresholds import Places
from estimator.errors import NotExciting
from estimator.identification.spectral import SpectralEstimate, spectral_estimate
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.layout import slot
from estimator.physics.model import Motion as Kind, Structure, unit
from estimator.signals.record import FloatArray, Record

_SIGNALS = {
    Element.TORQUE_PATH: ("torque", "torque"),
    Element.MOTOR: ("motor speed", "speed"),
    Element.SHAFT: ("shaft torque", "torque"),
    Element.LOAD: ("load speed", "speed"),
    Element.SPEED_SENSOR: ("motor speed", "speed"),
    Element.ACQUISITION: ("motor speed", "speed"),
}
"""Name and dimension of the signal that says where in an element's range something is."""


def error_spectrum(before: FitResult, after: FitResult, floor: float) -> ErrorSpectrum:
    """Return the density of the error of two fits, and where the first stands above the floor."""
    records = before.problem.records
    length = min(Places.SEGMENT, *(record.okay.size for record in records))
    frequency, first, averages = _density(before, length)
    _, second, _ = _density(after, length)
    density = 2.0 * floor**2 * records[0].sample_time_s
    return ErrorSpectrum(
        frequency[1:],
        np.sqrt(first[1:]),
        np.sqrt(second[1:]),
        float(np.sqrt(density)),
        _bands(frequency[1:], first[1:] / density, averages),
    )


def _density(result: FitResult, length: int) -> tuple[FloatArray, FloatArray, float]:
    """Return frequencies [Hz], mean density and the number of independent averages behind it."""
    records = result.problem.records
    total, weight = np.zeros(length // 2 + 1), 0.0
    frequency = np.fft.rfftfreq(length, records[0].sample_time_s).astype(np.float64)
    for i, record in enumerate(records):
        error = _error(result, i)
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
    """Return band edges at octaves, each band with a few frequencies; the last holds the highest."""
    edges = [float(frequency[-1]) * (1.0 + 1e-9)]
    step = float(frequency[1] - frequency[0])
    while 0.5 * edges[-1] >= max(float(frequency[0]), Places.FEWEST_PER_BAND * step):
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
            measured = spectral_estimate(_differenced(record, record.output))
        except NotExciting:  # not this recording: it is too short, or masked throughout
            continue
        simulated = [spectral_estimate(_differenced(record, output)) for output in (first, second)]
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
        reference_nm=None,
        load_nm=None,
    )


def _response(measured: SpectralEstimate, before: SpectralEstimate, after: SpectralEstimate) -> Response:
    return Response(
        measured.frequency_hz,
        measured.response,
        measured.magnitude_std,
        measured.coherence,
        before.response,
        after.response,
        _p_value(measured, before),
        _p_value(measured, after),
    )


def _p_value(measured: SpectralEstimate, model: SpectralEstimate) -> float:
    """Return how probable so large a difference of two responses is by chance, where the estimate is coherent."""
    good = (measured.coherence > Places.COHERENT) & (measured.coherence < 1.0)
    if not good.any():
        return 1.0
    deviation = np.abs(measured.response - model.response)[good] / measured.magnitude_std[good]
    degrees = 2.0 * float(good.sum())
    return float(stats.chi2.sf(float(deviation @ deviation), degrees))


def _error(result: FitResult, index: int) -> FloatArray:
    record = result.problem.records[index]
    return np.where(record.okay, result.outputs[index] - record.output, 0.0)


def _window_power(result: FitResult, index: int) -> tuple[FloatArray, FloatArray]:
    """Return the mean square error around each sample, and from how many good samples it is; shapes (N,)."""
    record = result.problem.records[index]
    width = min(max(1, round(Places.WINDOW_S / record.sample_time_s)), record.okay.size)
    window = np.ones(width)
    count = np.convolve(record.okay.astype(float), window, mode="same")
    power = np.convolve(_error(result, index) ** 2, window, mode="same") / np.maximum(count, 1.0)
    return power, np.rint(count).astype(np.float64)


def excess(result: FitResult, index: int, floor: float) -> FloatArray:
    """Return the mean square error above the floor around each sample, shape (N,); 0 where noise could be all."""
    power, count = _window_power(result, index)
    windows = max(power.size / max(float(count.max()), 1.0), 1.0)
    degrees, where = np.unique(np.maximum(count, 1.0), return_inverse=True)
    ratio = np.maximum(stats.chi2.isf(Places.FALSE_ALARM / windows, degrees) / degrees, Places.SMALLEST_RATIO)[where]
    return np.where(power > ratio * floor**2, power - floor**2, 0.0)


def intervals(result: FitResult, floor: float) -> dict[str, tuple[Interval, ...]]:
    """Return, per recording that has any, the times in which the error stands above the floor [s].

    An error that is clearly there raises every window it is in; what is seen for less than half a window is left out.
    """
    found = {}
    for i, record in enumerate(result.problem.records):
        above = excess(result, i, floor) > 0.0
        spans = [(float(record.time_s[a]), float(record.time_s[b - 1])) for a, b in runs(above)]
        shortest = 0.5 * min(Places.WINDOW_S, float(record.time_s[-1] - record.time_s[0]))
        kept = [span for span in _merged(spans) if span[1] - span[0] >= shortest]
        if kept:
            found[record.name] = tuple(kept)
    return found


def _merged(spans: Sequence[Interval]) -> list[Interval]:
    joined: list[Interval] = []
    for low, high in spans:
        if joined and low - joined[-1][1] < Places.WINDOW_S:
            joined[-1] = (joined[-1][0], high)
        else:
            joined.append((low, high))
    return joined


def band_hz(result: FitResult, noise: float) -> Interval | None:
    """Return the band that holds the central part of an error's power [Hz]; None where noise could be all."""
    records = result.problem.records
    length = min(Places.LONGEST_SEGMENT, records[0].okay.size)
    frequency: FloatArray = np.fft.rfftfreq(length, records[0].sample_time_s).astype(float)
    density: FloatArray = np.zeros(frequency.size)
    white, averages = 0.0, 0.0
    for i, record in enumerate(records):
        error = _error(result, i)
        length = min(Places.LONGEST_SEGMENT, error.size)
        segments = max(2.0 * error.size / length - 1.0, 1.0)
        density += segments * np.interp(frequency, *signal.welch(error, 1.0 / record.sample_time_s, nperseg=length))
        white += segments * 2.0 * noise**2 * record.sample_time_s
        averages += segments
    degrees = 2.0 * averages / (1.0 + 2.0 / 36.0)  # neighbours share half their samples (Welch)
    stands = density > white * stats.chi2.isf(Places.FALSE_ALARM / frequency.size, degrees) / degrees
    weight = np.where(stands, density - white, 0.0)
    return _central(frequency, weight) if weight.any() else None


def region(result: FitResult, element: Element, floor: float = 0.0, kind: Kind = Kind.ROTATION) -> Region:
    """Return where a mismatch is: the range of the element's signal that holds the central part of its power."""
    values, weights = [], []
    for i in range(len(result.problem.records)):
        values.append(_signal(element, motion_of(result, i), result))
        weights.append(excess(result, i, floor))
    x, w = np.concatenate(values), np.concatenate(weights)
    if not w.any():  # nowhere clearly above the floor: the power of all there is
        w = np.concatenate([_window_power(result, i)[0] for i in range(len(result.problem.records))])
    order = np.argsort(x)
    low, high = _central(x[order], w[order])
    signal, dimension = _SIGNALS[element]
    return Region(signal, low, high, unit(dimension, kind))


def _signal(element: Element, motion: Motion, result: FitResult) -> FloatArray:
    if element is Element.TORQUE_PATH:
        return motion.torque
    if element is Element.SHAFT:
        return result.p[slot("", "k")] * motion.twist
    return motion.load_speed if element is Element.LOAD else motion.speed


def _central(x: FloatArray, weight: FloatArray) -> Interval:
    """Return the values of sorted ``x`` between which the central part of the weight lies."""
    cumulative = np.cumsum(weight)
    share = cumulative / cumulative[-1]
    tail = 0.5 * (1.0 - Places.CENTRAL)
    low, high = np.searchsorted(share, [tail, 1.0 - tail])
    return float(x[low]), float(x[min(high, x.size - 1)])
