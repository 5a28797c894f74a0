"""Inertia seen by torque and motion, against the model's."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import detrend

from estimator.physics.driveline import Start
from estimator.physics.layout import Grid, flat
from estimator.physics.model import DrivelineModel, Structure, natural_frequencies_rad_s
from estimator.physics.motion import measured_speed
from estimator.physics.simulate import simulate
from estimator.signals.record import FloatArray, Record


def driven(record: Record, line: DrivelineModel, grid: Grid, from_hz: float = 0.0, to_hz: float = np.inf) -> FloatArray:
    """Simulate the output that the torque of a band of frequencies makes from rest; shape (N,) [unit of the output].

    The torque is taken without its mean; above 0 Hz without its trend, too.
    """
    torque = record.total_torque_nm - record.total_torque_nm.mean()
    if from_hz > 0.0 or to_hz < np.inf:
        frequency = np.fft.rfftfreq(torque.size, record.sample_time_s)
        spectrum = np.fft.rfft(detrend(torque))
        spectrum[(frequency < from_hz) | (frequency > to_hz)] = 0.0
        torque = np.fft.irfft(spectrum, torque.size)
    alone = replace(record, torque_nm=torque[:, np.newaxis], load_nm=None, torque_okay=None, offset_s=None)
    return simulate(grid, alone, flat(line), Start(0.0, 0.0, 0.0))


UNEQUAL = 1000.0
"""Ratio of two inertias from which on one of them is invisible from the other: 1 / 1000 of the motion."""


def model_warnings(model: DrivelineModel) -> list[str]:
    """Return what is odd about a model's values, one sentence each; values that can't be are refused by the model."""
    values = model.values()
    damping = _damping(values) if model.structure is Structure.TWO_MASS else []
    return [*_inertias({name: value for name, value in values.items() if name.startswith("J")}), *damping]


def _inertias(values: Mapping[str, float]) -> list[str]:
    small, large = min(values, key=values.__getitem__, default=""), max(values, key=values.__getitem__, default="")
    if small == large or values[large] < UNEQUAL * values[small]:
        return []
    return [
        f"model: {small} = {values[small]:g} and {large} = {values[large]:g} differ by a factor of "
        f"{values[large] / values[small]:.3g}; the smaller one can hardly be seen. Are both reflected to the motor "
        "shaft and in the same unit?"
    ]


def _damping(values: Mapping[str, float]) -> list[str]:
    first = float(natural_frequencies_rad_s(values)[0])
    ratio = 0.5 * values["c"] * first / values["k"]  # of the relative motion of two masses: 2 zeta w_0 = c w_0^2 / k
    if ratio < 1.0:
        return []
    return [
        f"model: with c = {values['c']:g} and k = {values['k']:g} the first mode ({first / (2.0 * math.pi):.3g} Hz) is "
        f"damped {ratio:.3g} times critically: the line does not oscillate. Are k and c in the right unit and order?"
    ]


BELOW, ABOVE = (0.1, 0.6), (1.6, math.inf)
"""The two bands, in first modes of the nominal model: a mode off by a quarter lies in neither."""

BLOCK_HZ, FEWEST_BINS = 1.0, 8
"""Frequencies compared at a time: few enough for a delay of some samples not to matter."""

BANDS_TELL = 0.5  # share of the output in either band that must follow from the torque
AGREE = 2.5  # factor between the ratios of the two bands up to which they are of one cause
STRETCH_S = 1.0  # over which the change of speed is looked at
FEWEST_STEPS = 10  # samples of a stretch at least
FEWEST_STRETCHES = 10  # stretches that a recording must hold to say anything: the regression has three unknowns

BODY_TELLS = 0.9
"""Share of the speed's changes that the torque must account for. Where a road or a brake moves the line and a control
sets the torque it is below 0.6, in tip-ins and reversals above."""


@dataclass(frozen=True, slots=True)
class Inertia:
    """The inertia that a recording fits over the nominal one, negative where the speed falls with the torque."""

    ratio: float
    share: float
    log_ratio: float = math.nan


NOTHING = Inertia(math.nan, 0.0)


def fitted_inertia(record: Record, line: DrivelineModel, grid: Grid | None) -> Inertia | None:
    first_hz = float(natural_frequencies_rad_s(line.values())[0]) / (2.0 * math.pi)
    log_ratio, found = math.nan, as_one_body(record, line, first_hz)
    if grid is not None and 0.0 < ABOVE[0] * first_hz < 0.5 / record.sample_time_s:
        below, above = (by_band(record, line, grid, low * first_hz, high * first_hz) for low, high in (BELOW, ABOVE))
        if min(below.share, above.share) >= BANDS_TELL:
            log_ratio = math.log(abs(below.ratio / above.ratio))
            if abs(log_ratio) <= math.log(AGREE):
                mean = math.copysign(math.sqrt(abs(below.ratio * above.ratio)), below.ratio)
                return Inertia(mean, max(below.share, found.share), log_ratio)  # comparable with that of one body alone
    return replace(found, log_ratio=log_ratio) if found.share >= BODY_TELLS else None


def by_band(record: Record, line: DrivelineModel, grid: Grid, low_hz: float, high_hz: float) -> Inertia:
    """Return the ratio of inertias by which the nominal answer to the torque is too large in a band."""
    model = driven(record, line, grid, 0.5 * low_hz, 2.0 * high_hz)
    good = np.flatnonzero(record.okay)
    output = np.interp(np.arange(model.size), good, record.output[good])
    frequency = np.fft.rfftfreq(model.size, record.sample_time_s)
    band = (frequency >= low_hz) & (frequency < high_hz)
    Y, M = (np.fft.rfft(detrend(signal) * np.hanning(signal.size))[band] for signal in (output, model))
    bins = max(FEWEST_BINS, round(BLOCK_HZ / frequency[1]))
    blocks = Y.size // bins
    if blocks == 0:
        return NOTHING
    Y, M = (spectrum[: blocks * bins].reshape(blocks, bins) for spectrum in (Y, M))
    cross, power = (Y * M.conj()).sum(axis=1), (np.abs(M) ** 2).sum(axis=1)
    total = float((np.abs(Y) ** 2).sum())
    if not (power > 0.0).all() or total == 0.0:
        return NOTHING
    ratio = float(power.sum() / np.abs(cross).sum())
    return Inertia(math.copysign(ratio, float(cross.real.sum())), float((np.abs(cross) ** 2 / power).sum()) / total)


def as_one_body(record: Record, line: DrivelineModel, first_hz: float) -> Inertia:
    """Return the ratio of inertias by which the impulse of the torque changes the speed."""
    step = max(round(STRETCH_S / record.sample_time_s), FEWEST_STEPS)
    width = min(step, max(1, round(1.0 / (first_hz * record.sample_time_s)))) if first_hz > 0.0 else 1
    inside = slice(width, record.okay.size - width)
    okay = record.okay[inside]
    both = okay[step:] & okay[:-step]
    if both.sum() < FEWEST_STRETCHES * step:
        return NOTHING
    signals = [uniform_filter1d(signal, width)[inside] for signal in _integrals(record)]
    changes = [(signal[step:] - signal[:-step])[both] for signal in signals]
    speed, impulse, turned = (change - change.mean() for change in changes)
    without = _rest(speed, turned[:, np.newaxis])
    design = np.column_stack([impulse, turned])
    inverse = float(np.linalg.lstsq(design, speed, rcond=None)[0][0])
    rest = _rest(speed, design)
    if inverse == 0.0 or not without @ without > 0.0:
        return NOTHING
    total = sum(value for name, value in line.values().items() if name.startswith("J"))
    return Inertia(1.0 / (inverse * total), 1.0 - float(rest @ rest) / float(without @ without))


def _integrals(record: Record) -> tuple[FloatArray, FloatArray, FloatArray]:
    speed = measured_speed(record)
    good = np.flatnonzero(np.isfinite(speed))
    speed = np.interp(np.arange(speed.size), good, speed[good])
    impulse = np.concatenate([[0.0], np.cumsum(record.total_torque_nm[:-1])]) * record.sample_time_s
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))]) * record.sample_time_s
    return speed, impulse, angle


def _rest(y: FloatArray, design: FloatArray) -> FloatArray:
    return y - design @ np.linalg.lstsq(design, y, rcond=None)[0]
