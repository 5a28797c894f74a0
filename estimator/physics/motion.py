"""What the recordings say about the motion before any model is fitted: sizes and whether the speed changes sign."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimator.physics.driveline import Driveline, Load
from estimator.signals.record import FloatArray, OutputKind, Record, once

SPEED_WINDOW_S = 0.02
"""Positions are differentiated over this window, so that encoder steps do not pass for speed."""

SHARES_DIFFER = 0.03
"""Least spread of the first input's share of the torque between recordings that distinguishes the inputs."""

MOST_TURNS = 100.0
"""Turns of the motor beyond which what it drives is taken to turn on and on, whatever its gear ratio."""

PLACES, FEWEST_PASSES = 50, 4.0
"""Places that the range of an angle is divided into, and how often it must be passed for them to be compared."""


@once
def measured_speed(record: Record) -> FloatArray:
    """Return the speed of a recording: measured, or the slope of the position; shape (N,), NaN where masked.

    An imposed motion is a position, known throughout.
    """
    if record.lead is not None:
        return measured_speed(record.lead)
    output = np.where(record.okay, record.output, np.nan) if record.imposed is None else record.imposed
    if record.imposed is None and record.kind is not OutputKind.POSITION:
        return output
    half = max(1, round(0.5 * SPEED_WINDOW_S / record.sample_time_s))
    slope = np.full_like(output, np.nan)
    slope[half:-half] = (output[2 * half :] - output[: -2 * half]) / (2 * half * record.sample_time_s)
    return slope


def speed_scale(records: Sequence[Record]) -> float:
    """Return the largest typical speed of the recordings: the 99th percentile of its size."""
    return max(_typical_speed(record) for record in records)


def torque_scale(records: Sequence[Record]) -> float:
    """Return the largest typical torque of the recordings: the 99th percentile of its size."""
    return max(_typical_torque(record) for record in records)


def longest_s(records: Sequence[Record]) -> float:
    """Return the length of the longest recording [s]."""
    return max(float(record.time_s[-1] - record.time_s[0]) for record in records)


@once
def _typical_speed(record: Record) -> float:
    return _typical(measured_speed(record))


@once
def _typical_torque(record: Record) -> float:
    return _typical(record.total_torque_nm)


def _typical(signal: FloatArray) -> float:
    """Where it rests for all but a short pulse, its peak; where it rests throughout, 1: a scale must not be zero."""
    size = np.abs(signal)
    return float(np.nanpercentile(size, 99)) or float(np.nanmax(size)) or 1.0


def reverses(record: Record) -> bool:
    """Tell whether the speed clearly takes both signs in a recording."""
    speed = measured_speed(record)
    threshold = 0.01 * float(np.nanpercentile(np.abs(speed), 99))
    return bool(np.sum(speed > threshold) >= 10 and np.sum(speed < -threshold) >= 10)


def turns(model: Driveline, records: Sequence[Record]) -> bool:
    """Tell whether the speed's sign can be distinguished from a constant load torque."""
    if not isinstance(model.load, Load) or any(reverses(record) for record in records):
        return True
    signs = {bool(np.nanmean(measured_speed(record)) > 0.0) for record in records}
    return model.load is Load.SHARED and len(signs) == 2


def torque_reverses(record: Record) -> bool:
    """Tell whether the torque clearly takes both signs in a recording (a tenth of its size, ten samples each)."""
    torque = record.total_torque_nm
    threshold = 0.1 * float(np.percentile(np.abs(torque), 99))
    return bool(np.sum(torque > threshold) >= 10 and np.sum(torque < -threshold) >= 10)


def largest_torque(records: Sequence[Record]) -> float:
    """Return the typical size of the largest torque of an inverter [Nm]."""
    return max(_typical(column) for record in records for column in record.torque_nm.T)


def shares_differ(records: Sequence[Record]) -> bool:
    """Tell whether the first torque input's share of the sum differs between recordings, or within one."""
    shares = []
    for record in records:
        first, total = record.torque_nm[:, 0], record.total_torque_nm
        third = max(first.size // 3, 1)
        for rows in (slice(0, third), slice(third, 2 * third), slice(2 * third, None)):
            power = float(total[rows] @ total[rows])
            if power > 0.0:
                shares.append(float(first[rows] @ total[rows]) / power)
    return bool(shares) and max(shares) - min(shares) > SHARES_DIFFER


def speeds_differ(records: Sequence[Record]) -> bool:
    """Tell whether the speeds of the recordings spread by more than a tenth of the top one."""
    speeds = np.concatenate([measured_speed(record) for record in records])
    low, high = np.nanpercentile(speeds, [5, 95])
    return bool(high - low > 0.1 * speed_scale(records))


def speed_sweeps(record: Record) -> bool:
    """Tell whether the speed of a recording changes by more than half of its top value."""
    low, high = np.nanpercentile(measured_speed(record), [2, 98])
    return bool(high - low > 0.5 * speed_scale([record]))


@once
def motor_angle(record: Record) -> FloatArray:
    """Return the motor angle by the record's own output, from 0 at its start; shape (N,) [rad].

    Laws that are periodic in the angle take their phase from it. A simulated angle would drift off by whole radians
    while a fit is still on its way.
    """
    if record.lead is not None:
        return motor_angle(record.lead)
    good = np.flatnonzero(record.okay)
    output = np.interp(record.time_s, record.time_s[good], record.output[good])
    if record.imposed is not None:
        return np.asarray(record.imposed - record.imposed[0])
    if record.kind is OutputKind.POSITION:
        return np.asarray(output - output[0])
    step = 0.5 * record.sample_time_s * (output[1:] + output[:-1])
    return np.concatenate([[0.0], np.cumsum(step)])


def range_of(records: Sequence[Record]) -> float:
    """Return the largest range of the motor's angle in a recording [rad]."""
    return max(float(np.ptp(motor_angle(record))) for record in records)


def turns_on(records: Sequence[Record]) -> bool:
    """Tell whether the motor turns on and on, and does not only go to and fro."""
    return range_of(records) > 2.0 * np.pi * MOST_TURNS


def goes_round(records: Sequence[Record], motor_turns: float) -> bool:
    """Tell whether the motor makes so many turns at least: over less nothing can be seen to recur."""
    return range_of(records) >= 2.0 * np.pi * motor_turns


def speed_by_place(record: Record) -> float:
    """Return the share of the speed's variance that goes with where the motor is: 1 where a motion only repeats."""
    angle, speed = motor_angle(record), np.abs(measured_speed(record))
    seen = np.isfinite(speed)
    angle, speed = angle[seen], speed[seen]
    if float(np.abs(np.diff(angle)).sum()) < FEWEST_PASSES * float(np.ptp(angle)) or float(np.var(speed)) == 0.0:
        return 0.0
    place = np.digitize(angle, np.linspace(angle.min(), angle.max(), PLACES))
    mean = np.bincount(place, speed) / np.maximum(np.bincount(place), 1)
    return 1.0 - float(np.mean((speed - mean[place]) ** 2) / np.var(speed))
