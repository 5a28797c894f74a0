"""The on-line model on the screen: frequency response, poles in z, resonance and damping with their history, alarms."""

from __future__ import annotations

import math
import textwrap

import numpy as np

from estimator.identification.tracking.alarm import Alarm, TrackingState
from estimator.signals.record import FloatArray
from hil.monitor.plot import AXIS, Canvas, Range, height_of, nice_range, strip, time_axis, title, with_axis, wrapped
from hil.monitor.snapshot import Estimation, Model, Snapshot

WIDEST_BAND = 0.5
"""Share of the value beyond which a band of two standard deviations is cut in a plot, and called UNSURE in words."""

FREQUENCY = "resonance_hz"
"""What an alarm calls a changed resonance; its unit says it where there is little room."""

LIVE = "live"
NOT_EXCITED = "NOT EXCITED"
CONTINUES = (LIVE, NOT_EXCITED)
"""What the title says while samples come in: that they are learnt from, or that they say nothing."""

REPORTED_SHARE = 0.01
"""From this share of missing samples on they are reported: a frame lost now and then is no news."""

LARGEST_REACH = 2.0
"""Real part up to which poles and zeros are in the picture; a spare zero may be anywhere."""

RESPONSE = "response w/T [dB], + measured"

ROOM_OF_TITLE = 6
"""Characters of a title besides its text and its value, a short rule included."""

HISTORY_S = 120.0
"""What the histories reach back [s]."""


def course(snapshot: Snapshot) -> str:
    """Tell in a word or two whether the estimate continues."""
    estimation = snapshot.estimation
    if not estimation.live:
        return "of the last run" if estimation.model else ""
    if snapshot.headline.phase not in ("measure", ""):
        return "not measuring yet"
    if snapshot.quality.stands_still:
        return f"STANDS STILL {snapshot.quality.standing_s:.1f} s"
    return NOT_EXCITED if estimation.state is TrackingState.NOT_EXCITED else LIVE


def condition(snapshot: Snapshot) -> str:
    """Tell how the estimate is: why it stands still, how many samples it had to do without, its own word."""
    estimation, quality = snapshot.estimation, snapshot.quality
    if estimation.live and quality.stands_still:
        return quality.why
    if course(snapshot) in CONTINUES and quality.bad_share >= REPORTED_SHARE:
        return f"{estimation.status}, {100.0 * quality.bad_share:.0f} % masked"
    return estimation.status


def alarm_line(alarm: Alarm) -> str:
    """Tell an alarm in a few words; dots where the estimate is still on its way."""
    change = f"{alarm.before.value:.3g} -> {alarm.after.value:.3g}"
    named = f"{change} Hz" if alarm.quantity == FREQUENCY else f"{alarm.quantity} {change}"
    return named if alarm.settled else f"{named} …"


def no_alarm(estimation: Estimation) -> str:
    """Say that there is no alarm, and what the watch is doing while samples come in."""
    doing = "" if estimation.state is None or not estimation.live else f", {estimation.state.words}"
    return f"alarms    none{doing}"


def nothing_yet(snapshot: Snapshot) -> str:
    """Say why there is no model."""
    hint = ": start an experiment (e)" if snapshot.can_drive and not snapshot.estimation.live else ""
    return f"no on-line model yet{hint}"


def with_interval(value: float, std: float, unit: str, digits: int) -> str:
    """Write a value with two standard deviations, as far as they are known; UNSURE where they say little of it."""
    if not math.isfinite(value):
        return "--"
    if 2.0 * std > WIDEST_BAND * abs(value):
        return f"{value:.{digits}f} ±{2.0 * std:.2g} {unit}".rstrip() + " UNSURE"
    interval = f" ±{2.0 * std:.{digits}f}" if math.isfinite(std) else ""
    return f"{value:.{digits}f}{interval} {unit}".rstrip()


def resonance_in_words(estimation: Estimation) -> str:
    """Write the resonance, with how sure it is."""
    return with_interval(estimation.resonance_hz, estimation.resonance_std_hz, "Hz", 2)


def response(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Magnitude of the frequency response of the on-line model, both axes logarithmic."""
    estimation = snapshot.estimation
    model = estimation.model
    value = "--" if model is None else resonance_in_words(estimation)
    if len(RESPONSE) + len(value) + ROOM_OF_TITLE > width:
        value = f"{estimation.resonance_hz:.2f} Hz"  # how sure it is stands among the figures
    head = title(RESPONSE, value, width)
    if model is None:
        return wrapped(head, nothing_yet(snapshot), width, height)
    decibel = 20.0 * np.log10(np.maximum(model.gain, 1e-12))
    x = np.log10(model.frequency_hz)
    y_range = nice_range(decibel, 20.0)
    low_hz, high_hz = float(model.frequency_hz[0]), float(model.frequency_hz[-1])
    x_range = Range(math.log10(low_hz), math.log10(high_hz))
    plot = strip(x, decibel, x_range, y_range, width, height - 2)
    return [head, *_with_measured(plot, model, x_range, y_range), _frequency_axis(low_hz, high_hz, width)]


def _with_measured(plot: list[str], model: Model, x_range: Range, y_range: Range) -> list[str]:
    """Mark the response of the last samples without a model by crosses, over the line of the model."""
    lines = [list(line) for line in plot]
    inside = (np.log10(model.measured_hz) - x_range.low) / (x_range.high - x_range.low)
    height = height_of(20.0 * np.log10(np.maximum(model.measured_gain, 1e-12)), y_range, len(lines))
    for share, row in zip(inside.tolist(), height.tolist(), strict=True):
        column = AXIS + round(share * (len(lines[0]) - AXIS - 1)) if lines else 0
        if 0.0 <= share <= 1.0 and 0 <= round(row) < len(lines):
            lines[round(row)][column] = "+"
    return ["".join(line) for line in lines]


def poles(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Upper half of the z plane: the unit circle, the poles now (x), the zeros now (o), poles before as dots."""
    head = title("z plane: x pole, o zero, dots before", "", width)
    model = snapshot.estimation.model
    if model is None:
        return wrapped(head, nothing_yet(snapshot), width, height)
    canvas = Canvas(width, height - 1)
    reach = float(np.clip(np.max(np.abs(np.r_[model.poles.real, model.zeros.real])), 1.0, LARGEST_REACH))
    radius = max(0.0, min((canvas.width - 4.0) / 2.0 / reach, canvas.height - 2.0))
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
    head = title("resonance [Hz]", resonance_in_words(snapshot.estimation), width)
    return _history(snapshot, head, history.frequency_hz, history.frequency_std_hz, 0.5, width, height)


def damping(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Damping ratio over time, with its band of two standard deviations."""
    estimation = snapshot.estimation
    head = title("damping ratio", with_interval(estimation.damping, estimation.damping_std, "", 4), width)
    return _history(snapshot, head, estimation.history.damping, estimation.history.damping_std, 0.02, width, height)


def figures(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Resonance, damping, the estimator's own word and the last alarm, in words."""
    estimation = snapshot.estimation
    alarms = estimation.alarms
    values, label = [], ""  # while there are none, the reason takes their room
    if math.isfinite(estimation.resonance_hz):
        values = [
            f"resonance {resonance_in_words(estimation)}",
            f"damping   {with_interval(estimation.damping, estimation.damping_std, '', 4)}",
        ]
        label = f"{'status':10}"
    last = f"ALARM {len(alarms)}: {alarm_line(alarms[-1])}" if alarms else no_alarm(estimation)
    status = textwrap.wrap(f"{label}{condition(snapshot)}", max(width, 8))
    room = max(1, height - 2 - len(values))
    lines = [title("estimate", course(snapshot), width), *values, *status[:room], last]
    return [line[:width] for line in lines][:height]


def standing(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Say whether the estimate continues, and why not, for the pages that have only plots."""
    why = snapshot.quality.reasons
    parts = (course(snapshot), condition(snapshot) + (f" ({why})" if course(snapshot) in CONTINUES and why else ""))
    return textwrap.wrap(f"estimate: {', '.join(part for part in parts if part)}", max(width, 8))[:height]


def alarms(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Alarms, the latest first: what changed, from where to where, on what evidence."""
    found = snapshot.estimation.alarms
    lines = [title("alarms", f"{len(found)}" if found else "none", width)]
    for alarm in reversed(found):
        text = f"ALARM {alarm.statement}, evidence {alarm.statistic:.3g} above {alarm.threshold:.3g}"
        lines += textwrap.wrap(text, max(width, 1), subsequent_indent="  ")
    return [line[:width] for line in lines][:height]


def _history(
    snapshot: Snapshot, head: str, values: FloatArray, std: FloatArray, least: float, width: int, height: int
) -> list[str]:
    """Plot points over the last two minutes, each with its band, cut at `WIDEST_BAND`."""
    time_s, rows = snapshot.estimation.history.time_s, height - 2
    if not time_s.size:
        return wrapped(head, nothing_yet(snapshot), width, height)
    recent = time_s >= -HISTORY_S
    time_s, values = time_s[recent], values[recent]
    std = np.minimum(np.nan_to_num(2.0 * std[recent]), WIDEST_BAND * np.abs(values))
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
