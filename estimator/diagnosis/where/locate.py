"""Where simulation and recordings differ: when, at which frequencies and in which operating region."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import signal, stats

from estimator.diagnosis.line import Motion, motion_of
from estimator.diagnosis.result import Interval, Region
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.layout import slot
from estimator.signals.record import FloatArray

WINDOW_S = 0.5
"""Errors are averaged over this time before they are called a mismatch."""

FALSE_ALARM = 0.01
"""Probability that noise alone is called a mismatch anywhere in a recording."""

SMALLEST_RATIO = 1.2
"""Mean square, in floors, that a window must reach at least: the floor itself is known to about a tenth."""

CENTRAL = 0.8
"""Share of the mismatch's power that band and region hold."""

LONGEST_SEGMENT = 512
"""Samples of a segment of Welch's average."""


def _errors(result: FitResult, index: int) -> FloatArray:
    record = result.problem.records[index]
    errors: FloatArray = np.where(record.okay, result.outputs[index] - record.output, 0.0)
    return errors


def _window_power(result: FitResult, index: int) -> tuple[FloatArray, FloatArray]:
    """Return the mean square error around each sample, and from how many good samples it is; shapes (N,)."""
    record = result.problem.records[index]
    width = min(max(1, round(WINDOW_S / record.sample_time_s)), record.okay.size)
    window = np.ones(width)
    count = np.convolve(record.okay.astype(float), window, mode="same")
    power = np.convolve(_errors(result, index) ** 2, window, mode="same") / np.maximum(count, 1.0)
    return power, np.rint(count).astype(np.float64)


def excess(result: FitResult, index: int, floor: float) -> FloatArray:
    """Return the mean square error above the floor around each sample, shape (N,); 0 where noise could be all."""
    power, count = _window_power(result, index)
    windows = max(power.size / max(float(count.max()), 1.0), 1.0)
    degrees, where = np.unique(np.maximum(count, 1.0), return_inverse=True)
    ratio = np.maximum(stats.chi2.isf(FALSE_ALARM / windows, degrees) / degrees, SMALLEST_RATIO)[where]
    stands: FloatArray = np.where(power > ratio * floor**2, power - floor**2, 0.0)
    return stands


def intervals(result: FitResult, floor: float) -> dict[str, tuple[Interval, ...]]:
    """Return, per recording that has any, the times in which the error stands above the floor [s].

    An error that is clearly there raises every window it is in; what is seen for less than half a window is left out.
    """
    found = {}
    for i, record in enumerate(result.problem.records):
        above = excess(result, i, floor) > 0.0
        edges = np.flatnonzero(np.diff(np.concatenate([[0], above.astype(int), [0]])))
        spans = [(float(record.time_s[a]), float(record.time_s[b - 1])) for a, b in edges.reshape(-1, 2)]
        shortest = 0.5 * min(WINDOW_S, float(record.time_s[-1] - record.time_s[0]))
        kept = [span for span in _merged(spans) if span[1] - span[0] >= shortest]
        if kept:
            found[record.name] = tuple(kept)
    return found


def _merged(spans: Sequence[Interval]) -> list[Interval]:
    """Join intervals that are closer than a window."""
    joined: list[Interval] = []
    for low, high in spans:
        if joined and low - joined[-1][1] < WINDOW_S:
            joined[-1] = (joined[-1][0], high)
        else:
            joined.append((low, high))
    return joined


def band_hz(mismatch: Sequence[FloatArray], sample_times_s: Sequence[float], noise: float) -> Interval | None:
    """Return the band that holds the central part of a mismatch's power [Hz]; None where noise could be all.

    Parameters
    ----------
    mismatch : sequence of ndarray, shape (N_i,)
        Per recording, 0 where a sample is missing.
    sample_times_s : sequence of float
        Their sampling periods.
    noise : float
        RMS of the white noise in them; only frequencies that stand above it count. 0 where simulations are compared.
    """
    frequency: FloatArray = np.fft.rfftfreq(min(LONGEST_SEGMENT, mismatch[0].size), sample_times_s[0]).astype(float)
    density: FloatArray = np.zeros(frequency.size)
    white, averages = 0.0, 0.0
    for errors, sample_time_s in zip(mismatch, sample_times_s, strict=True):
        length = min(LONGEST_SEGMENT, errors.size)
        segments = max(2.0 * errors.size / length - 1.0, 1.0)
        density += segments * np.interp(frequency, *signal.welch(errors, 1.0 / sample_time_s, nperseg=length))
        white += segments * 2.0 * noise**2 * sample_time_s
        averages += segments
    degrees = 2.0 * averages / (1.0 + 2.0 / 36.0)  # neighbours share half their samples (Welch)
    stands = density > white * stats.chi2.isf(FALSE_ALARM / frequency.size, degrees) / degrees
    weight = np.where(stands, density - white, 0.0)
    return _central(frequency, weight) if weight.any() else None


def region(result: FitResult, element: Element, floor: float = 0.0) -> Region:
    """Return the range of the element's own signal that holds the central part of the error's power above the floor."""
    values, weights = [], []
    for i in range(len(result.problem.records)):
        values.append(_signal(element, motion_of(result, i), result))
        weights.append(excess(result, i, floor))
    x, w = np.concatenate(values), np.concatenate(weights)
    if not w.any():  # nowhere clearly above the floor: the power of all there is
        w = np.concatenate([_window_power(result, i)[0] for i in range(len(result.problem.records))])
    order = np.argsort(x)
    low, high = _central(x[order], w[order])
    return Region(_SIGNAL_NAMES[element], low, high)


_SIGNAL_NAMES = {
    Element.TORQUE_PATH: "torque",
    Element.MOTOR: "motor speed",
    Element.SHAFT: "shaft torque",
    Element.LOAD: "load speed",
    Element.SPEED_SENSOR: "motor speed",
    Element.ACQUISITION: "motor speed",
}


def _signal(element: Element, motion: Motion, result: FitResult) -> FloatArray:
    if element is Element.TORQUE_PATH:
        return motion.torque
    if element is Element.SHAFT:
        stiffness: FloatArray = result.p[slot("", "k")] * motion.twist
        return stiffness
    return motion.load_speed if element is Element.LOAD else motion.speed


def _central(x: FloatArray, weight: FloatArray) -> Interval:
    """Return the values of sorted ``x`` between which the central part of the weight lies."""
    cumulative = np.cumsum(weight)
    share = cumulative / cumulative[-1]
    tail = 0.5 * (1.0 - CENTRAL)
    low, high = np.searchsorted(share, [tail, 1.0 - tail])
    return float(x[low]), float(x[min(high, x.size - 1)])
