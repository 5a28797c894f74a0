"""Panels of the signals: torque, speed, PRBS and twist over the last seconds."""

from __future__ import annotations

import math

import numpy as np

from estimator.signals.record import FloatArray
from hil.monitor.plot import Range, nice_range, strip, time_axis, title
from hil.monitor.snapshot import Signals, Snapshot

ROOM_FOR_PARTS = 60
"""Characters from which on the torque's title has each inverter's."""


def torque(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Draw the total torque as both inverters report it."""
    s = snapshot.signals
    total_nm, reference_nm = _latest(s.torque_nm), _latest(s.reference_nm)
    parts = f"m1 {s.torque_m1_nm:.1f} m2 {s.torque_m2_nm:.1f} " if width >= ROOM_FOR_PARTS else ""
    now = f"{total_nm:.1f} ({parts}ref {reference_nm:.1f})"
    return _draw(s, "torque [Nm]", s.torque_nm, 10.0, _or_why_not(snapshot, now), width, height)


def speed(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Draw the motor speed, gaps where a sample does not count."""
    s = snapshot.signals
    now = _or_why_not(snapshot, f"{_latest(s.speed_rad_s):.2f}")
    return _draw(s, "speed [rad/s]", s.speed_rad_s, 1.0, now, width, height)


def prbs(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Draw the part of the reference that is PRBS."""
    s = snapshot.signals
    return _draw(s, "PRBS [Nm]", s.prbs_nm, 10.0, f"{_latest(s.prbs_nm):.0f}", width, height)


def twist(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Draw the estimated twist of the shaft, and below it the time axis of all."""
    s = snapshot.signals
    mrad = 1e3 * s.twist_rad
    now = f"{_latest(mrad):.1f} ±{2e3 * s.twist_std_rad:.1f}" if math.isfinite(s.twist_std_rad) else "--"
    now = _or_why_not(snapshot, now)  # without readings it is the model's word alone
    lines = _draw(s, f"twist [mrad], {s.twist_of}", mrad, 2.0, now, width, height - 1)
    return [*lines, time_axis(s.window_s, width)]


def channels(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Give each further channel of the rig file a line: its column, unit and value."""
    lines = []
    for channel in snapshot.signals.channels:
        now = _or_why_not(snapshot, f"{_latest(channel.values):.5g}".replace("nan", "--"))
        room = max(0, width - len(now) - 1)
        lines.append(f"{f'{channel.name} [{channel.unit}]'[:room]:<{room}} {now}"[:width])
    if len(lines) > height > 0:
        lines = [*lines[: height - 1], f"+{len(lines) - height + 1} more channels"[:width]]
    return lines


def _draw(
    signals: Signals, name: str, values: FloatArray, least: float, now: str, width: int, height: int
) -> list[str]:
    """Draw a signal under its name and its present value; its axis spans ``least`` at least."""
    y_range = nice_range(values, least)
    plot = strip(signals.time_s, values, Range(-signals.window_s, 0.0), y_range, width, height - 1)
    return [title(name, now.replace("nan", "--"), width), *plot]


def _or_why_not(snapshot: Snapshot, now: str) -> str:
    """Say in place of a present value why there is none."""
    quality = snapshot.quality
    return f"NO VALUE: {quality.why}" if quality.stands_still else now


def _latest(values: FloatArray) -> float:
    """Give the last value there is; a gap of a few samples does not make the number flicker."""
    known = values[np.isfinite(values)]
    return float(known[-1]) if known.size else math.nan
