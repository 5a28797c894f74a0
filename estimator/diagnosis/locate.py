"""Where simulation and recordings differ: when, at which frequencies and in which operating region."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import signal

from estimator.diagnosis.disturbances import Motion, motion_of
from estimator.diagnosis.result import Interval, Region
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.layout import slot
from estimator.signals.record import FloatArray

WINDOW_S = 0.5
"""Errors are averaged over this time before they are called a mismatch."""

TIMES_FLOOR = 2.0
"""Mean square, in floors, above which a window holds a mismatch: 50 samples of noise alone reach 1.6 at 3 sigma."""

CENTRAL = 0.8
"""Share of the mismatch's power that band and region hold."""


def _errors(result: FitResult, index: int) -> FloatArray:
    record = result.problem.records[index]
    errors: FloatArray = np.where(record.okay, result.outputs[index] - record.output, 0.0)
    return errors


def _window_power(errors: FloatArray, sample_time_s: float) -> FloatArray:
    width = min(max(1, round(WINDOW_S / sample_time_s)), errors.size)
    smooth: FloatArray = np.convolve(errors**2, np.full(width, 1.0 / width), mode="same")
    return smooth


def intervals(result: FitResult, floor: float) -> dict[str, tuple[Interval, ...]]:
    """Return, per recording that has any, the times in which the error stands above the floor [s]."""
    found = {}
    for i, record in enumerate(result.problem.records):
        power = _window_power(_errors(result, i), record.sample_time_s)
        above = power > TIMES_FLOOR * floor**2
        edges = np.flatnonzero(np.diff(np.concatenate([[0], above.astype(int), [0]])))
        spans = [(float(record.time_s[a]), float(record.time_s[b - 1])) for a, b in edges.reshape(-1, 2)]
        if spans:
            found[record.name] = tuple(_merged(spans))
    return found


def _merged(spans: Sequence[Interval]) -> list[Interval]:
    """Join intervals that are closer than a window."""
    joined = [spans[0]]
    for low, high in spans[1:]:
        if low - joined[-1][1] < WINDOW_S:
            joined[-1] = (joined[-1][0], high)
        else:
            joined.append((low, high))
    return joined


def band_hz(result: FitResult, floor: float) -> Interval | None:
    """Return the band that holds the central part of the error's power above the floor [Hz]."""
    totals = []
    for i, record in enumerate(result.problem.records):
        errors = _errors(result, i)
        frequency, density = signal.welch(errors, 1.0 / record.sample_time_s, nperseg=min(512, errors.size))
        white = 2.0 * floor**2 * record.sample_time_s
        totals.append((frequency, np.maximum(density - white, 0.0)))
    frequency = totals[0][0]
    excess_density = sum(np.interp(frequency, f, d) for f, d in totals)
    if not np.any(excess_density > 0):
        return None
    low, high = _central(frequency, np.asarray(excess_density))
    return (low, high)


def region(result: FitResult, element: Element) -> Region:
    """Return the range of the element's own signal that holds the central part of the error's power."""
    values, weights = [], []
    for i, record in enumerate(result.problem.records):
        values.append(_signal(element, motion_of(result, i), result))
        weights.append(_window_power(_errors(result, i), record.sample_time_s))
    x, w = np.concatenate(values), np.concatenate(weights)
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
