"""What of the recordings is fitted: segments between long gaps, thinned; and their diagnosis put together again.

Over a short gap the simulation continues with the torque it has. Over a long one it would diverge: the torque there was
not read, or the model does not hold there (a mask: another brake, a gear change). So each segment is a recording of its
own, with its own initial state and, as every recording, its own constant load torque: a road is not as steep behind a
gap as before it. Time continues (``Record.began_s``), for laws over time.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from itertools import pairwise
from math import sqrt
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.result import (
    Course,
    Diagnosis,
    Estimated,
    Profile,
    Trace,
)
from estimator.diagnosis.thresholds import Noise, Recordings, Segments
from estimator.physics.model import DrivelineModel, Structure, natural_frequencies_rad_s
from estimator.signals.record import Channel, FloatArray, Record, sliced

SEED = 1
TURN = 2.0 * np.pi


@dataclass(frozen=True, slots=True)
class Cut:
    """Recordings, cut."""

    whole: tuple[Record, ...]  # as they were given
    records: tuple[Record, ...]  # what is left of them for a fit
    rows: Mapping[str, slice]  # of each segment, by its name
    origin: Mapping[str, str]  # name of every record to the name of its recording
    warnings: tuple[str, ...] = ()  # what was left out

    def of(self, names: Iterable[str]) -> tuple[Record, ...]:
        """Return what is left of the recordings of these names."""
        wanted = set(names)
        return tuple(record for record in self.records if self.origin[record.name] in wanted)


def segments(record: Record) -> list[slice]:
    """Return the rows of each segment of a recording, in order; short gaps stay in, at its ends, too."""
    longest = max(round(Segments.LONG_S / record.sample_time_s), Segments.LONG_SAMPLES)
    good = np.flatnonzero(record.okay)
    breaks = np.flatnonzero(np.diff(good) > longest + 1)
    first = good[np.concatenate([[0], breaks + 1])]
    last = good[np.concatenate([breaks, [good.size - 1]])]
    if first[0] <= longest:
        first[0] = 0
    if record.okay.size - 1 - last[-1] <= longest:
        last[-1] = record.okay.size - 1
    return [slice(int(a), int(b) + 1) for a, b in zip(first, last, strict=True)]


def tiles(record: Record) -> list[Record]:
    """Return the segments of a recording, each up to where the next begins: all rows, for a simulation of each."""
    parts = segments(record)
    starts = [part.start for part in parts[1:] if int(record.okay[part].sum()) >= Segments.FEWEST_FOR_START]
    if not starts:
        return [record]
    edges = [0, *starts, record.okay.size]
    return [sliced(record, slice(first, end)) for first, end in pairwise(edges)]


def cut(records: Sequence[Record]) -> Cut:
    """Cut recordings at their long gaps and leave out segments that are too short."""
    kept: list[Record] = []
    rows: dict[str, slice] = {}
    origin: dict[str, str] = {}
    warnings: list[str] = []
    share = share_of(records)
    for record in records:
        found = segments(record)
        long = found
        if len(found) > 1:
            long = [part for part in found if _is_long(record, part)]
            warnings.append(_gaps_warning(record, found, long))
        used = stretches(record, long, share)
        if used == [slice(0, record.okay.size)]:
            kept.append(record)
            origin[record.name] = record.name
            continue
        if used != long:
            warnings.append(_stretches_warning(record, long, used))
        for i, part in enumerate(used, start=1):
            name = record.name if len(used) == 1 and len(found) == 1 else f"{record.name}#{i}"
            kept.append(sliced(record, part, name))
            rows[name], origin[name] = part, record.name
    return Cut(tuple(records), tuple(kept), rows, origin, tuple(warnings))


def _is_long(record: Record, part: slice) -> bool:
    good = int(record.okay[part].sum())
    return good >= max(Segments.FEWEST_SAMPLES, round(Segments.SHORTEST_S / record.sample_time_s))


def _gaps_warning(record: Record, found: Sequence[slice], long: Sequence[slice]) -> str:
    least = max(Segments.FEWEST_SAMPLES * record.sample_time_s, Segments.SHORTEST_S)
    text = f"recording {record.name}: gaps of more than {Segments.LONG_S:g} s cut it into {len(found)} segments"
    if not long:
        return f"{text}, none of which holds {least:g} s of good samples; it is not used. Check flags and mask."
    used = sum(int(record.okay[part].sum()) for part in long) / int(record.okay.sum())
    short = len(found) - len(long)
    left_out = f"; {short} of less than {least:g} s left out; used: {used:.0%} of the good samples"
    return f"{text}, each with its own initial state and constant load{left_out if short else ''}."


def _stretches_warning(record: Record, long: Sequence[slice], used: Sequence[slice]) -> str:
    whole, seen = (sum(part.stop - part.start for part in parts) * record.sample_time_s for parts in (long, used))
    return (
        f"recording {record.name}: {seen:.0f} s of its {whole:.0f} s are used, in {len(used)} stretches, each with its "
        "own initial state and constant load."
    )


Over = TypeVar("Over", Course, Profile)


def joined(diagnosis: Diagnosis, cut: Cut) -> Diagnosis:
    """Return a diagnosis of segments under the names of the recordings they are of."""
    if not cut.rows:
        return diagnosis
    found: Diagnosis = _renamed(replace(diagnosis, traces=()), cut)
    by_name = {trace.name: trace for trace in diagnosis.traces}
    return replace(found, traces=tuple(_by_recording(by_name, cut).values()))


def _renamed(value: Any, cut: Cut) -> Any:
    """Return a part of a diagnosis with recordings where it has segments: in texts, and in what is given for each."""
    if isinstance(value, str):
        return _text(value, cut)
    if isinstance(value, tuple):
        return tuple(_renamed(each, cut) for each in value)
    if isinstance(value, Mapping) and value and value.keys() <= cut.origin.keys():
        return _by_recording(value, cut)
    if is_dataclass(value) and not isinstance(value, DrivelineModel | type):
        return replace(value, **{each.name: _renamed(getattr(value, each.name), cut) for each in fields(value)})
    return value


def _by_recording(values: Mapping[str, Any], cut: Cut) -> dict[str, Any]:
    """Join the values of the segments of each recording, in the order of the recordings."""
    found = {}
    for record in cut.whole:
        parts = {name: value for name, value in values.items() if cut.origin[name] == record.name}
        if parts:
            found[record.name] = _together(parts, cut)
    return found


def _together(parts: Mapping[str, Any], cut: Cut) -> Any:
    first = next(iter(parts.values()))
    if isinstance(first, tuple):
        return tuple(each for values in parts.values() for each in values)
    if isinstance(first, Estimated):
        return _mean(parts, cut)
    if isinstance(first, Course | Profile):
        return _with_breaks(list(parts.values()))
    if isinstance(first, Trace):
        return _whole(parts, cut)
    good = {record.name: int(record.okay.sum()) for record in cut.records}
    return parts[max(parts, key=good.__getitem__)]


def _text(text: str, cut: Cut) -> str:
    if not cut.rows:
        return text
    names = sorted(cut.rows, key=len, reverse=True)  # run#12 before run#1
    return re.sub("|".join(map(re.escape, names)), lambda match: cut.origin[match.group()], text)


def _mean(parts: Mapping[str, Estimated], cut: Cut) -> Estimated:
    """Return the mean of independent estimates, each counting by its segment's good samples."""
    good = {record.name: int(record.okay.sum()) for record in cut.records}
    weights = np.array([good[name] for name in parts], dtype=np.float64)
    weights /= weights.sum()
    value = float(weights @ [part.value for part in parts.values()])
    half = [0.5 * (part.ci95[1] - part.ci95[0]) for part in parts.values()]
    spread = float(np.linalg.norm(weights * half))
    return Estimated(value, (value - spread, value + spread), next(iter(parts.values())).unit)


def _with_breaks(parts: Sequence[Over]) -> Over:
    """Put courses over time one after the other, with a NaN between that breaks the line."""
    time_s: list[FloatArray] = []
    for before, after in zip(parts, [*parts[1:], None], strict=True):
        time_s.append(before.time_s)
        if after is not None:
            time_s.append(np.array([0.5 * (before.time_s[-1] + after.time_s[0])]))

    def values(arrays: Iterable[FloatArray]) -> FloatArray:
        broken = [piece for array in arrays for piece in (array, np.array([np.nan]))]
        return np.concatenate(broken[:-1])

    return replace(
        parts[0],
        time_s=np.concatenate(time_s),
        value=values(part.value for part in parts),
        low=values(part.low for part in parts),
        high=values(part.high for part in parts),
    )


def _whole(parts: Mapping[str, Trace], cut: Cut) -> Trace:
    """Return the trace of a recording from those of its segments."""
    first = next(iter(parts))
    if first not in cut.rows:
        return parts[first]
    record = next(record for record in cut.whole if record.name == cut.origin[first])
    nominal, retuned, augmented = np.full((3, record.okay.size), np.nan)
    okay = np.zeros_like(record.okay)
    for name, part in parts.items():
        rows = cut.rows[name]
        okay[rows] = part.okay
        nominal[rows], retuned[rows], augmented[rows] = part.nominal, part.retuned, part.augmented
    return replace(
        parts[first],
        name=record.name,
        time_s=record.time_s,
        torque_nm=record.torque_nm,
        measured=record.output,
        okay=okay,
        nominal=nominal,
        retuned=retuned,
        augmented=augmented,
    )


def shortened_to_memory(segments: Cut, training: Iterable[str]) -> tuple[Cut, list[str]]:
    """Leave out pieces of the recordings that are fitted, as many as a fit can't hold; say which are used."""
    pieces = segments.of(training)
    used = list(pieces)
    while (size := _size(used)) > Recordings.MOST_SAMPLES_TIMES_RECORDINGS and len(used) > 1:
        used = _some(pieces, min(int(len(used) * sqrt(Recordings.MOST_SAMPLES_TIMES_RECORDINGS / size)), len(used) - 1))
    if len(used) == len(pieces):
        return segments, []
    left_out = {piece.name for piece in pieces} - {piece.name for piece in used}
    kept = tuple(record for record in segments.records if record.name not in left_out)
    return replace(segments, records=kept), [_warning(used, pieces)]


def _size(pieces: Sequence[Record]) -> int:
    return len(pieces) * sum(int(piece.output.shape[0]) for piece in pieces)


def _some(pieces: Sequence[Record], count: int) -> list[Record]:
    """Return one of each of so many equal parts of the list, at least one in all."""
    edges = np.linspace(0, len(pieces), max(count, 1) + 1).astype(int)
    return [pieces[i] for i in np.random.default_rng(SEED).integers(edges[:-1], edges[1:])]


def _warning(used: Sequence[Record], pieces: Sequence[Record]) -> str:
    return (
        f"{len(used)} of {len(pieces)} recordings are used (each piece between long gaps, or stretch of a long one, "
        f"counts as one), drawn from the whole list: {', '.join(piece.name for piece in used)}. Each has unknowns of "
        "its own, so more would take gigabytes. Give those that matter, and the others by --holdout."
    )


def thinned(records: Sequence[Record], model: DrivelineModel) -> list[Record]:
    """Return recordings with as many samples as the model's fastest mode needs; those that have no more as they are."""
    if share_of(records) >= 1.0 or model.structure is Structure.JOINT:
        return list(records)
    return [thin(record, factor_for([record], model)) for record in records]


def as_slow_as_needed(records: Sequence[Record], model: DrivelineModel) -> list[Record]:
    """Return recordings with no more samples than the line can answer to: between them only the sensor is seen."""
    shortest = min(record.okay.size for record in records)
    factor = min(factor_for(records, model, Recordings.LONGEST_OF_RIGID_S), max(shortest // Recordings.FEWEST_KEPT, 1))
    return [thin(record, factor) for record in records]


def factor_for(records: Sequence[Record], model: DrivelineModel, longest_s: float = Recordings.LONGEST_S) -> int:
    """Return one in how many samples is enough for recordings of one sampling period."""
    joint = model.structure is Structure.JOINT
    fastest_hz = max(map(_band_hz, records)) if joint else float(natural_frequencies_rad_s(model.values())[-1]) / TURN
    if fastest_hz > 0.0:
        longest_s = min(longest_s, 1.0 / (Recordings.PER_PERIOD * fastest_hz))
    return max(1, int(longest_s / records[0].sample_time_s * (1.0 + 1e-9)))


def _band_hz(record: Record) -> float:
    """Return the frequency below which nearly all the power of an output is [Hz]."""
    output = np.where(record.okay, record.output, np.mean(record.output[record.okay]))
    power = np.cumsum(np.abs(np.fft.rfft(output - output.mean())) ** 2)
    index = int(np.searchsorted(power, Recordings.BAND_POWER * power[-1]))
    return float(np.fft.rfftfreq(output.size, record.sample_time_s)[index])


def thin(record: Record, factor: int) -> Record:
    """Return a recording with one in ``factor`` of its samples."""
    if factor == 1:
        return record
    count = record.okay.size // factor
    kept = slice(0, count * factor, factor)
    trusted = np.asarray(_blocks(record.torque_trusted, factor).all(axis=1))
    return replace(
        record,
        sample_time_s=factor * record.sample_time_s,
        time_s=record.time_s[kept],
        torque_nm=_blocks(record.torque_nm, factor).mean(axis=1),
        output=record.output[kept],
        okay=record.okay[kept],
        torque_okay=None if record.torque_okay is None else trusted,
        offset_s=None if record.offset_s is None else record.offset_s[kept],
        imposed=None if record.imposed is None else record.imposed[kept],
        reference_nm=None if record.reference_nm is None else _blocks(record.reference_nm, factor).mean(axis=1),
        load_nm=None if record.load_nm is None else _blocks(record.load_nm, factor).mean(axis=1),
        channels=_kept(record.channels, kept),
        unused=_kept(record.unused, kept),
    )


def _kept(channels: Sequence[Channel], rows: slice) -> tuple[Channel, ...]:
    return tuple(replace(each, output=each.output[rows], okay=each.okay[rows]) for each in channels)


def _blocks(values: NDArray[Any], factor: int) -> NDArray[Any]:
    count = values.shape[0] // factor
    return values[: count * factor].reshape(count, factor, *values.shape[1:])


def share_of(records: Sequence[Record]) -> float:
    """Return which part of the samples of all recordings may be used."""
    return Noise.MOST_SAMPLES / sum(record.okay.size for record in records)


def stretches(record: Record, parts: Sequence[slice], share: float) -> list[slice]:
    """Return the rows of a recording that are used, in order."""
    if share >= 1.0:
        return list(parts)
    longest = max(round(Noise.LONGEST_S / record.sample_time_s), 1)
    return [piece for part in parts for piece in _pieces(part, longest, share)]


def _pieces(part: slice, longest: int, share: float) -> list[slice]:
    size = part.stop - part.start
    allowed = min(size, max(math.ceil(share * size), longest))
    count = math.ceil(allowed / longest)
    length = allowed // count
    starts = part.start + np.linspace(0, size - length, count).astype(int)
    return [slice(int(start), int(start) + length) for start in starts]
