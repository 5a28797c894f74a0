"""Channels that no sensor made: clipped, wrapped, dead, repeated, or of another clock."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np

from estimator.diagnosis.acquisition.finding import runs
from estimator.diagnosis.thresholds import Channels, Recordings
from estimator.errors import NotExciting
from estimator.physics.motion import measured_speed
from estimator.signals.record import BoolArray, Channel, FloatArray, IntArray, Location, OutputKind, Record

TURN = math.tau


def period_of(values: FloatArray, seen: BoolArray) -> float | None:
    """Return after how much a reading begins anew; None where it does not."""
    both = seen[1:] & seen[:-1] & (values[1:] != 0.0) & (values[:-1] != 0.0)  # a lost reading is zero
    steps = np.where(both, np.diff(values), 0.0)
    jumps = np.abs(steps) > Channels.HALF * float(np.ptp(values[seen]))
    if not jumps.any() or jumps.all():
        return None
    largest = float(np.abs(steps[~jumps]).max())
    sizes = np.abs(steps[jumps])
    if sizes.min() <= Channels.FAR * largest or float(np.ptp(sizes)) > 2.0 * largest:
        return None
    onward = np.array([_motion(steps, jumps, i) for i in np.flatnonzero(jumps).tolist()])
    period = float(np.mean(np.sign(steps[jumps]) * (steps[jumps] - onward)))
    if abs(period / TURN - 1.0) <= Channels.NEAR_A_TURN:
        return TURN
    return period if sizes.size > 1 else None


def _motion(steps: FloatArray, jumps: BoolArray, at: int) -> float:
    around = [i for i in (at - 1, at + 1) if 0 <= i < steps.size and not jumps[i]]
    return float(np.mean(steps[around])) if around else 0.0


def unwrapped(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Put wrapped positions together again; say so."""
    corrected, warnings = [], []
    for record in records:
        seen = record.okay & np.isfinite(record.output)
        period = period_of(record.output, seen) if record.kind is OutputKind.POSITION and seen.any() else None
        if period is None:
            corrected.append(record)
            continue
        output = record.output.copy()
        output[seen] = np.unwrap(output[seen], period=period)
        corrected.append(replace(record, output=output))
        warnings.append(
            f"recording {record.name}: the position wraps after {period:.6g} and was unwrapped. If it is no wrapped "
            "angle, give it as it was read, without jumps."
        )
    return corrected, warnings


@dataclass(frozen=True, slots=True)
class Clipped:
    """One channel at one limit: the value, and in which rows it stands there, shape (N,)."""

    channel: str  # in words, for a warning
    value: float  # the limit, in the channel's unit
    rows: BoolArray  # where it stands there


def clipped(channel: str, values: FloatArray, seen: BoolArray) -> list[Clipped]:
    """Return the limits at which a channel is clipped: an end that is met far more often than other values are."""
    levels, counts = np.unique(values[seen], return_counts=True)
    if levels.size < Channels.FEWEST_LEVELS:
        return []
    others = counts[1:-1][levels[1:-1] != 0.0]
    found = []
    for end in (0, -1):
        limit = float(levels[end])
        often = counts[end] >= max(
            Channels.FEWEST_SAMPLES, Channels.SMALLEST_SHARE * values.size, Channels.OFTEN * others.max(initial=1)
        )
        rows: BoolArray = seen & (values == limit)
        if limit != 0.0 and often and _at_pace(values, seen, rows):
            found.append(Clipped(channel, limit, rows))
    return found


def _at_pace(values: FloatArray, seen: BoolArray, rows: BoolArray) -> bool:
    """Tell whether a signal is still moving as it usually does when it comes to where it stands."""
    before = np.abs(values[1:-1] - values[:-2])
    read = seen[2:] & seen[1:-1] & seen[:-2]
    comes = before[read & rows[2:] & ~rows[1:-1]]
    usual = before[read & ~rows[1:-1] & ~rows[:-2] & (before > 0.0)]
    return bool(comes.size and usual.size and np.median(comes) >= Channels.AT_PACE * np.median(usual))


def without_clipped(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Mask the rows in which the output is cut off; say so, and say where a torque seems to be.

    A torque that stands at its limit may be cut off in the reading or held there by the drive; the reading
    alone doesn't show which, so its rows stay.
    """
    corrected, warnings = [], []
    for record in records:
        okay = record.okay.copy()
        for found in clipped(record.kind.value, record.output, record.okay & np.isfinite(record.output)):
            okay &= ~found.rows
            warnings.append(
                f"recording {record.name}: the {found.channel} stands at its limit {found.value:g} in "
                f"{found.rows.mean():.1%} of the rows: its reading is cut off there; these rows are not used. "
                "Widen the range of the sensor or of its scale."
            )
        corrected.append(record if np.array_equal(okay, record.okay) else replace(record, okay=okay))
        warnings += [*_torques(record), *dead_torques(record)]
    return corrected, warnings


def _torques(record: Record) -> list[str]:
    trusted = record.torque_trusted
    return [
        f"recording {record.name}: {found.channel} stands at its limit {found.value:g} in {found.rows.mean():.1%} of "
        "the rows. If the drive limited it, the reading is right; if the reading is cut off, the verdict can't be "
        "trusted: mask these rows ([signals] mask) or widen the range."
        for i in range(record.torque_nm.shape[1])
        for found in clipped(record.input(i), record.torque_nm[:, i], trusted[:, i])
    ]


def dead_rows(torque: FloatArray, sample_time_s: float) -> BoolArray:
    """Tell where a torque stands still for long, of one that elsewhere hardly ever does."""
    ends = np.flatnonzero(np.diff(torque) != 0.0) + 1
    spans = np.diff([0, *ends.tolist(), torque.size])
    long = spans * sample_time_s >= Channels.DEAD_S
    dead = np.repeat(long, spans)
    return dead if np.count_nonzero(long) == 1 and not dead.all() else np.zeros(torque.size, dtype=np.bool_)


def dead_torques(record: Record) -> list[str]:
    """Say which of several torques never changes, and which are one channel twice."""
    inputs = record.torque_nm.T if record.torque_nm.shape[1] > 1 else ()
    twice = [
        f"recording {record.name}: {record.input(i)} and {record.input(k)} are equal in every row. Is it one channel, "
        "logged twice?"
        for i, k in combinations(range(len(inputs)), 2)
        if record.inputs and np.ptp(inputs[i]) > 0.0 and np.array_equal(inputs[i], inputs[k])
    ]
    for i, torque in enumerate(record.torque_nm.T):
        if (rows := dead_rows(torque, record.sample_time_s)).any():
            twice.append(
                f"recording {record.name}: {record.input(i)} stands still at {torque[rows][0]:g} from "
                f"{record.time_s[rows][0]:.4g} to {record.time_s[rows][-1]:.4g} s. If its inverter was off there, that "
                "is right; if the channel was dead, leave that stretch out ([signals] from_s, to_s or stretches)."
            )
    return twice + [
        f"recording {record.name}: {record.input(i)} stays at {values[0]:g}. If its inverter did not work, that is "
        "right; if the channel is dead, noise, values and verdict can't be trusted: what was not read counts as noise "
        "and as missing physics."
        for i, values in enumerate(inputs)
        if np.ptp(values) == 0.0
    ]


def standstill(record: Record) -> str:
    """Say of a recording whose output never changes what that means; empty for any other."""
    seen, torque = record.output[record.okay], record.total_torque_nm[record.okay]
    if record.imposed is not None or not seen.size or np.ptp(seen) > 0.0:
        return ""
    what = f"recording {record.name}: the {record.kind.value} is constant at {seen[0]:g}, expected it to vary"
    turns = record.kind is OutputKind.SPEED and seen[0] != 0.0
    if turns or not np.ptp(torque) > 0.0:
        return f"{what}: is its sensor dead? Excite the driveline (PRBS, reversal, tip-in) and check the channel."
    return (
        f"{what}: under torques of up to {np.abs(torque).max():.3g} Nm the line is held (brake, parking lock) by at "
        "least that much, or the sensor is dead. Release what holds it, and check the channel."
    )


def with_usable_channels(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Return recordings with the further outputs that a fit can use, and what is wrong with the others."""
    kept, warnings = [], []
    for record in records:
        usable: list[Channel] = []
        for channel in record.channels:
            channel, dead = _without_dead(record, channel)
            warnings += [f"recording {record.name}: the output {channel.label} {notes}" for notes in dead]
            fault = _fault(record, channel, usable)
            if fault:
                warnings.append(f"recording {record.name}: the output {channel.label} is not used: {fault}")
            else:
                usable.append(channel)
        kept.append(replace(record, channels=tuple(usable)) if record.channels else record)
    return kept, warnings


def _without_dead(record: Record, channel: Channel) -> tuple[Channel, list[str]]:
    """Return a channel without the stretches in which its sensor stood still though the motor did not, and which."""
    read = channel.output[channel.okay]
    if read.size == 0 or np.ptp(read) == 0.0:  # never read, or dead throughout: for `_fault` to say
        return channel, []
    like, okay, notes = _goes_like(record, channel), channel.okay.copy(), []
    least = max(2, round(Channels.DEAD_S / record.sample_time_s))
    ends = np.flatnonzero(np.diff(channel.output) != 0.0) + 1
    for first, end in pairwise([0, *ends.tolist(), channel.output.size]):
        if end - first >= least and np.ptp(like[first:end]) > Channels.MOVED * np.nanstd(like):
            okay[first:end] = False
            notes.append(
                f"stays at {channel.output[first]:g} from {record.time_s[first]:g} to {record.time_s[end - 1]:g} s, "
                "while the motor moves: its sensor is dead there, and it is not used there."
            )
    return replace(channel, okay=okay), notes


def _fault(record: Record, channel: Channel, others: Sequence[Channel]) -> str:
    """Return what keeps a channel out of a fit; empty where nothing does."""
    good = channel.okay & record.okay
    if good.sum() < Channels.FEWEST_GOOD * record.okay.sum():
        return f"{good.sum()} of {record.okay.sum()} good rows hold a reading of it. Record it at the others' rate."
    values = channel.output[good]
    spread = float(np.std(values))
    if spread <= Channels.IDENTICAL_SHARE * (float(np.abs(values).max()) or 1.0):
        return f"it stays at {values[0]:g}: its sensor is dead, or not the column that was meant."
    for label, other in (("the recording's first output", record.output), *((o.label, o.output) for o in others)):
        if np.nanmax(np.abs(other[good] - values)) <= Channels.IDENTICAL_SHARE * spread:
            return f"it is the same signal as {label}. Name each sensor once."
    like = _goes_like(record, channel)
    seen = good & np.isfinite(like)
    width = max(1, round(Channels.SMOOTH_S / record.sample_time_s))
    mine, its = (_smooth(np.where(seen, each, 0.0), width) for each in (channel.output, like))
    return _turned(channel, mine[seen], its[seen], seen.sum() / width) or _off_clock(record, mine, its, seen)


def _turned(channel: Channel, mine: FloatArray, its: FloatArray, independent: float) -> str:
    mine, its = mine - mine.mean(), its - its.mean()
    both = float(np.linalg.norm(mine) * np.linalg.norm(its))
    alike = float(mine @ its) / both if both else 0.0
    if channel.kind is not OutputKind.TORQUE or channel.location is not Location.LOAD:
        if abs(alike) < Channels.CHANCE / np.sqrt(independent):
            return "it does not follow the motor at all: it is another signal, or the sensor shows only noise."
    if alike < -Channels.LEAST_CORRELATION:
        return "it moves opposite to the motor: its sign is turned. Give it a negative scale."
    if channel.kind is OutputKind.SPEED and alike > Channels.LEAST_CORRELATION:
        ratio = float(np.linalg.norm(mine) / np.linalg.norm(its))
        if not 1.0 / Channels.MOST_RATIO < ratio < Channels.MOST_RATIO:
            return (
                f"it is {ratio:.3g} times the motor's speed: outputs must be reflected to the motor shaft. "
                f"Multiply its scale by {1.0 / ratio:.4g}, the gear's ratio."
            )
    return ""


def _off_clock(record: Record, mine: FloatArray, its: FloatArray, seen: BoolArray) -> str:
    """Say by how much the clock of a channel runs at another rate than that of the first output.

    A sensor that is elsewhere in the line lags by as much at the end as at the beginning; one that has another clock
    does not.
    """
    shifts = max(1, round(Channels.LAG_STEP_S / record.sample_time_s)) * np.arange(-Channels.LAGS, Channels.LAGS + 1)
    rows = np.flatnonzero(seen)[shifts[-1] : -shifts[-1]]
    blocks = [
        each[(each >= shifts[-1]) & (each < its.size - shifts[-1])] for each in np.array_split(rows, Channels.BLOCKS)
    ]
    if min(block.size for block in blocks) < shifts.size:  # too short to tell
        return ""
    lags = [record.sample_time_s * _lag(mine, its, block, shifts) for block in blocks]
    times = [float(record.time_s[block].mean()) for block in blocks]
    (rate, _), spread = np.polyfit(times, lags, 1, cov=True)
    apart_s = abs(float(rate)) * float(record.time_s[-1] - record.time_s[0])
    if abs(rate) <= Channels.CLEARLY * float(np.sqrt(spread[0, 0])) or apart_s <= record.sample_time_s:
        return ""
    return (
        f"its clock and that of the first output differ by {abs(rate) * 1e6:.0f} ppm, {apart_s:.3g} s over the "
        "recording. Record both with one device, or correct the clock first."
    )


def _lag(mine: FloatArray, its: FloatArray, rows: IntArray, shifts: IntArray) -> float:
    """Return the lag of the highest correlation over some rows, between its neighbours by a parabola [samples]."""
    own = mine[rows] - mine[rows].mean()
    other = [its[rows - shift] - its[rows - shift].mean() for shift in shifts]
    likeness = np.array([own @ each / (np.linalg.norm(each) or 1.0) for each in other])
    best = int(np.argmax(likeness))
    if 0 < best < likeness.size - 1:
        before, top, after = likeness[best - 1 : best + 2]
        off = 0.5 * (before - after) / (before - 2.0 * top + after)
        return float(shifts[best] + off * (shifts[1] - shifts[0]))
    return float(shifts[best])


def _goes_like(record: Record, channel: Channel) -> FloatArray:
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


@dataclass(frozen=True, slots=True)
class NotRead:
    """Rows of a channel that no sensor has read, shape (N,), and what is there instead."""

    channel: str  # in words, for a warning
    rows: BoolArray  # where it was not read
    held: bool  # the value before stands there; else it is interpolated


def not_read(channel: str, values: FloatArray, seen: BoolArray, may_rest: bool) -> list[NotRead]:
    """Return the rows in which a channel is interpolated, and those in which it is held at one value."""
    whole = seen[:-2] & seen[1:-1] & seen[2:]
    steps = np.abs(np.diff(values))
    if not whole.any() or not (steps > 0.0).any():
        return []
    rounding = max(
        Recordings.ROUNDING * float(steps[steps > 0.0].min()), Recordings.SMOOTH * float(np.ptp(values[seen]))
    )
    bend = np.abs(np.diff(values, 2))
    bent = bend[whole & (bend > rounding)]
    usual = float(np.median(bent)) if bent.size else 0.0
    if usual < Recordings.BENT * rounding:
        return []
    drawn, held = np.zeros_like(seen), np.zeros_like(seen)
    for first, behind in runs(whole & (bend <= rounding)):
        rows = slice(first, behind + 2)  # a triple has two rows more
        if behind + 2 - first < Recordings.FEWEST_IN_A_ROW:
            continue
        moved = float(np.ptp(values[rows]))
        drawn[rows] |= moved >= usual
        held[rows] |= moved == 0.0 and values[first] != 0.0
    if may_rest or float(np.mean(steps[~(held[1:] & held[:-1])] == 0.0)) > Recordings.SELDOM:
        held[:] = False
    return [NotRead(channel, rows, rows is held) for rows in (drawn, held) if rows.any()]


def without_not_read(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Mask the rows in which the output was not read; say so.

    A torque that lies on straight lines may be one that was commanded: ramps, and levels.
    """
    corrected, warnings = [], []
    for record in records:
        okay = record.okay.copy()
        seen = record.okay & np.isfinite(record.output)
        for found in not_read(record.kind.value, record.output, seen, record.kind is not OutputKind.SPEED):
            okay &= ~found.rows
            what = "stands still to the last digit" if found.held else "lies on straight lines to the last digit"
            why = "its reading had stopped" if found.held else "it was interpolated, not read"
            warnings.append(
                f"recording {record.name}: the {found.channel} {what} in {found.rows.mean():.1%} of the rows: {why} "
                "there; these rows are not used. Give the raw recording, with its gaps."
            )
        corrected.append(record if np.array_equal(okay, record.okay) else replace(record, okay=okay))
    return corrected, warnings


def with_motion_corrected(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Return recordings unwrapped and without what no sensor has read, and a warning for each change."""
    warnings: list[str] = []
    corrected = list(records)
    for correct in (unwrapped, without_clipped, without_not_read, with_usable_channels):
        corrected, notes = correct(corrected)
        warnings += notes
    return corrected, warnings


def require_signals(record: Record) -> None:
    """Refuse a recording with too few good samples, or of which torque or output does not change."""
    good = int(record.okay.sum())
    if good < Recordings.FEWEST_SAMPLES:
        raise NotExciting(
            f"recording {record.name}: {good} good samples, expected at least {Recordings.FEWEST_SAMPLES}. Record "
            "longer.",
            (record.name,),
        )
    driven_by = ("torque", record.total_torque_nm) if record.imposed is None else ("imposed motion", record.imposed)
    still = standstill(record)
    for what, values in (driven_by, ("output", record.output)):
        seen = values[record.okay]
        if not still and float(np.ptp(seen)) == 0.0:
            still = (
                f"recording {record.name}: the {what} is constant at {seen[0]:g}, expected it to vary. "
                "Excite the driveline (PRBS, reversal, tip-in) and check the channel."
            )
    if still:
        raise NotExciting(still, (record.name,))
