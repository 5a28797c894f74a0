"""Further measured outputs that can take part in a fit; what is wrong with the others is said, and the rest is used.

A speed at the load goes as the motor's does, but for the shaft's twist; an angle as its integral, an acceleration as
its slope, a shaft's torque as the torque that drives it. A channel that goes the other way, or much more or less than
that, is turned round, or not reflected to the motor shaft, or it is another signal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimator.physics.motion import measured_speed
from estimator.signals.record import BoolArray, Channel, FloatArray, Location, OutputKind, Record

FEWEST_GOOD = 0.5
"""Share of the recording's good rows that a channel must have read."""

ALIKE = 0.5
"""Correlation with what a channel should go like from which it goes like that, or the other way."""

MOST_RATIO = 2.0
"""Factor by which a speed may be larger or smaller than the motor's: the shaft's twist is no part of its spread."""

SAME = 1e-9
"""Difference over the spread up to which two channels are one signal."""

SMOOTH_S = 0.2
"""Width of the mean over which channels are compared: below a driveline's first mode both ends move as one."""


def with_usable_channels(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Return recordings with the further outputs that a fit can use, and what is wrong with the others."""
    kept, warnings = [], []
    for record in records:
        usable: list[Channel] = []
        for channel in record.channels:
            fault = _fault(record, channel, usable)
            if fault:
                warnings.append(f"recording {record.name}: the output {channel.label} is not used: {fault}")
            else:
                usable.append(channel)
        kept.append(replace(record, channels=tuple(usable)) if record.channels else record)
    return kept, warnings


def _fault(record: Record, channel: Channel, others: Sequence[Channel]) -> str:
    """Return what keeps a channel out of a fit; empty where nothing does."""
    good = channel.okay & record.okay
    if good.sum() < FEWEST_GOOD * record.okay.sum():
        return f"{good.sum()} of {record.okay.sum()} good rows hold a reading of it. Record it at the others' rate."
    values = channel.output[good]
    spread = float(np.std(values))
    if spread <= SAME * (float(np.abs(values).max()) or 1.0):
        return f"it stays at {values[0]:g}: its sensor is dead, or not the column that was meant."
    for label, other in (("the recording's first output", record.output), *((o.label, o.output) for o in others)):
        if np.nanmax(np.abs(other[good] - values)) <= SAME * spread:
            return f"it is the same signal as {label}. Name each sensor once."
    return _turned(record, channel, good)


def _turned(record: Record, channel: Channel, good: BoolArray) -> str:
    like = _goes_like(record, channel)
    seen = good & np.isfinite(like)
    width = max(1, round(SMOOTH_S / record.sample_time_s))
    mine, its = (_smooth(np.where(seen, each, 0.0), width)[seen] for each in (channel.output, like))
    mine, its = mine - mine.mean(), its - its.mean()
    both = float(np.linalg.norm(mine) * np.linalg.norm(its))
    alike = float(mine @ its) / both if both else 0.0
    if alike < -ALIKE:
        return "it goes the other way than the motor: turned round. Give it a negative scale."
    if channel.kind is OutputKind.SPEED and alike > ALIKE:
        ratio = float(np.linalg.norm(mine) / np.linalg.norm(its))
        if not 1.0 / MOST_RATIO < ratio < MOST_RATIO:
            return (
                f"it is {ratio:.3g} times the motor's speed: outputs are given as the motor shaft sees them. "
                f"Multiply its scale by {1.0 / ratio:.4g}, the gear's ratio."
            )
    return ""


def _goes_like(record: Record, channel: Channel) -> FloatArray:
    """Return what a channel should go like, shape (N,), NaN where that is not known."""
    speed = measured_speed(record)
    if channel.kind is OutputKind.TORQUE or channel.location is Location.SHAFT:
        return record.total_torque_nm
    if channel.kind is OutputKind.ACCELERATION:
        return np.gradient(speed, record.sample_time_s)
    if channel.kind is OutputKind.POSITION:
        return np.nancumsum(speed) * record.sample_time_s
    return speed


def _smooth(values: FloatArray, width: int) -> FloatArray:
    return np.convolve(values, np.full(width, 1.0 / width), mode="same")
