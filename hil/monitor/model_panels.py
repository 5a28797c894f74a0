"""Panels of the on-line model: frequency response, poles in z, resonance and damping with their history, alarms."""

from __future__ import annotations

import math
import textwrap

import numpy as np

from hil.monitor.braille import Canvas
from hil.monitor.plot import AXIS, Range, height_of, nice_range, strip, time_axis, title, with_axis, wrapped
from hil.monitor.snapshot import Estimation, Snapshot

LARGEST_REACH = 2.0
"""Real part up to which poles and zeros are in the picture; a spare zero may be anywhere."""

HISTORY_S = 120.0
"""What the histories reach back [s]."""


def response(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Magnitude of the frequency response of the on-line model, both axes logarithmic."""
    estimation = snapshot.estimation
    head = title("response |w/T| [dB]", _resonance(estimation), width)
    model = estimation.model
    if model is None:
        return wrapped(head, nothing_yet(snapshot), width, height)
    decibel = 20.0 * np.log10(np.maximum(model.gain, 1e-12))
    x = np.log10(model.frequency_hz)
    y_range = nice_range(decibel, 20.0)
    low_hz, high_hz = float(model.frequency_hz[0]), float(model.frequency_hz[-1])
    plot = strip(x, decibel, Range(math.log10(low_hz), math.log10(high_hz)), y_range, width, height - 2)
    return [head, *plot, _frequency_axis(low_hz, high_hz, width)]


def poles(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Upper half of the z plane: the unit circle, the poles now (x), the zeros now (o), poles before as dots."""
    head = title("z plane: x pole, o zero, dots before", "", width)
    model = snapshot.estimation.model
    if model is None:
        return wrapped(head, nothing_yet(snapshot), width, height)
    canvas = Canvas(width, height - 1)
    reach = float(np.clip(np.max(np.abs(np.r_[model.poles.real, model.zeros.real])), 1.0, LARGEST_REACH))
    radius = min((canvas.width - 4.0) / 2.0 / reach, canvas.height - 2.0)
    centre, bottom = canvas.width / 2.0, canvas.height - 1.0
    for angle in np.linspace(0.0, math.pi, round(2.0 * radius)).tolist():
        canvas.dot(centre + radius * math.cos(angle), bottom - radius * math.sin(angle))
    for z in model.trail.tolist():
        if z.imag >= 0.0:
            canvas.dot(centre + radius * z.real, bottom - radius * z.imag)
    lines = [list(line) for line in canvas.lines()]
    for points, mark in ((model.zeros, "o"), (model.poles, "x")):
        for z in points.tolist():
            column, row = round((centre + radius * z.real) / 2.0), int((bottom - radius * z.imag) / 4.0)
            if z.imag >= -1e-9 and 0 <= row < len(lines) and 0 <= column < width:
                lines[row][column] = mark
    return [head, *("".join(line) for line in lines)]


def resonance(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Resonance over time, with its band of two standard deviations."""
    history = snapshot.estimation.history
    head = title("resonance [Hz]", _resonance(snapshot.estimation), width)
    return _history(head, history.time_s, history.frequency_hz, history.frequency_std_hz, 0.5, width, height)


def damping(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Damping ratio over time, with its band of two standard deviations."""
    estimation = snapshot.estimation
    head = title("damping ratio", with_interval(estimation.damping, estimation.damping_std, "", 4), width)
    history = estimation.history
    return _history(head, history.time_s, history.damping, history.damping_std, 0.02, width, height)


def figures(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Resonance, damping, the estimator's own word and the last alarm, in words."""
    estimation = snapshot.estimation
    alarms = estimation.alarms
    lines = [
        title("estimate", "live" if estimation.live else "of the last run" if estimation.model else "", width),
        f"resonance {_resonance(estimation)}",
        f"damping   {with_interval(estimation.damping, estimation.damping_std, '', 4)}",
        f"status    {estimation.status}",
        f"alarms    {len(alarms)}" + (f", last: {alarm_line(snapshot)}" if alarms else ""),
    ]
    return [line[:width] for line in lines][:height]


def alarms(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Alarms, the latest first: what changed, from where to where, on what evidence."""
    found = snapshot.estimation.alarms
    lines = [title("alarms", f"{len(found)}" if found else "none", width)]
    for alarm in reversed(found):
        text = f"ALARM {alarm.statement}, evidence {alarm.statistic:.3g} above {alarm.threshold:.3g}"
        lines += textwrap.wrap(text, max(width, 1), subsequent_indent="  ")
    return [line[:width] for line in lines][:height]


def alarm_line(snapshot: Snapshot) -> str:
    """Tell the last alarm in a few words; empty where there is none."""
    found = snapshot.estimation.alarms
    if not found:
        return ""
    last = found[-1]
    still = "" if last.settled else ", goes on"
    return f"{last.quantity} {last.before.value:.4g} -> {last.after.value:.4g}{still}"


def nothing_yet(snapshot: Snapshot) -> str:
    """Say why there is no model."""
    hint = ": start an experiment (e)" if snapshot.can_drive and not snapshot.estimation.live else ""
    return f"no on-line model yet{hint}"


def with_interval(value: float, std: float, unit: str, digits: int) -> str:
    """Write a value with two standard deviations, as far as they are known."""
    if not math.isfinite(value):
        return "--"
    interval = f" ±{2.0 * std:.{digits}f}" if math.isfinite(std) else ""
    return f"{value:.{digits}f}{interval} {unit}".rstrip()


def _resonance(estimation: Estimation) -> str:
    return with_interval(estimation.resonance_hz, estimation.resonance_std_hz, "Hz", 2)


def _history(
    head: str, time_s: np.ndarray, values: np.ndarray, std: np.ndarray, least: float, width: int, height: int
) -> list[str]:
    """Plot points over the last two minutes, each with its band."""
    rows = height - 2
    recent = time_s >= -HISTORY_S
    time_s, values, std = time_s[recent], values[recent], np.nan_to_num(2.0 * std[recent])
    y_range = nice_range(np.r_[values - std, values + std], least)
    canvas = Canvas(width - AXIS, rows)
    x = (time_s / HISTORY_S + 1.0) * (canvas.width - 1)
    for column, low, high in zip(
        x.tolist(),
        height_of(values - std, y_range, canvas.height).tolist(),
        height_of(values + std, y_range, canvas.height).tolist(),
        strict=True,
    ):
        canvas.bar(round(column), high, low)
    return [head, *with_axis(canvas.lines(), y_range, rows), time_axis(HISTORY_S, width)]


def _frequency_axis(low_hz: float, high_hz: float, width: int) -> str:
    """Write a logarithmic axis with the round frequencies that have room."""
    room = width - AXIS
    line = [" "] * width
    line[AXIS - 1] = "└"
    span = math.log10(high_hz / low_hz)
    free = AXIS
    for hertz in (0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500):
        if not low_hz <= hertz <= high_hz:
            continue
        label = f"{hertz:g}"
        at = AXIS + round(math.log10(hertz / low_hz) / span * (room - 1))
        at = min(at, width - len(label) - 3)
        if at >= free:
            line[at : at + len(label)] = label
            free = at + len(label) + 1
    line[width - 2 :] = "Hz"
    return "".join(line)
