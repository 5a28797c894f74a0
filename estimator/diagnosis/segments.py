"""Recordings with long gaps, cut into segments for the fit; ``joined`` puts the result together again.

Over a short gap the simulation continues with the torque it has. Over a long one it would diverge: the torque there was
not read, or the model does not hold there (a mask: another brake, a gear change). So each segment is a recording of its
own, with its own initial state and, as every recording, its own constant load torque: a road is not as steep behind a
gap as before it. Time continues (``Record.began_s``), for laws over time.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from estimator.diagnosis.noise import share_of, stretches
from estimator.signals.record import Record, sliced

LONG_S = 1.0
"""A gap that is longer ends a segment."""

LONG_SAMPLES = 10
"""It must also hold more samples than this: where sampling is slow, a few lost ones are no gap."""

SHORTEST_S = 2.0
"""Good samples of a segment must cover this: less can't tell its initial state and its load from all else."""

FEWEST_SAMPLES = 50
"""Good samples of a segment at least: more than twice what a predictor of its own error looks back on."""

FEWEST_FOR_START = 10
"""Good samples from which initial state and load are read off for a simulation alone."""


@dataclass(frozen=True, slots=True)
class Cut:
    """Recordings, cut.

    Attributes
    ----------
    whole : tuple of Record
        As they were given.
    records : tuple of Record
        What is left of them for a fit; a recording without long gaps as it is.
    rows : mapping of str to slice
        Of each segment, by its name: its rows in its recording. Recordings that are not cut are not in it.
    origin : mapping of str to str
        Name of every record to the name of its recording.
    warnings : tuple of str
        What was left out.
    """

    whole: tuple[Record, ...]
    records: tuple[Record, ...]
    rows: Mapping[str, slice]
    origin: Mapping[str, str]
    warnings: tuple[str, ...] = ()

    def of(self, names: Iterable[str]) -> tuple[Record, ...]:
        """Return what is left of the recordings of these names."""
        wanted = set(names)
        return tuple(record for record in self.records if self.origin[record.name] in wanted)


def segments(record: Record) -> list[slice]:
    """Return the rows of each segment of a recording, in order; short gaps stay in, at its ends, too."""
    longest = max(round(LONG_S / record.sample_time_s), LONG_SAMPLES)
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
    """Return the segments of a recording, each up to where the next begins: all rows, for a simulation of each.

    One of fewer than ``FEWEST_FOR_START`` good samples goes with the one before it.
    """
    parts = segments(record)
    starts = [part.start for part in parts[1:] if int(record.okay[part].sum()) >= FEWEST_FOR_START]
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
    return good >= max(FEWEST_SAMPLES, round(SHORTEST_S / record.sample_time_s))


def _gaps_warning(record: Record, found: Sequence[slice], long: Sequence[slice]) -> str:
    least = max(FEWEST_SAMPLES * record.sample_time_s, SHORTEST_S)
    text = f"recording {record.name}: gaps of more than {LONG_S:g} s cut it into {len(found)} segments"
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
