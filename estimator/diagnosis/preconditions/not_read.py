"""Stretches of a channel that no sensor has read: interpolated, or held at one value.

Noise and a driveline's own motion bend every reading. Where many samples in a row lie on a straight line to the last
digit that the file has, a logger or a converter filled a gap; a speed that stays at one value while it changes from
sample to sample elsewhere is a reading that has stopped. Both look like physics: a straight line of a car's speed over
a hilly minute is a force that nobody drove with.

What is read in coarse steps, or is at rest, is straight by itself: there nothing is looked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.signals.record import BoolArray, FloatArray, OutputKind, Record

FEWEST_SAMPLES = 20
"""Samples in a row that count: by chance two in three of the steps between them would have to be alike."""

ROUNDING = 2.0
"""How far three samples of a straight line may be off one, in the file's least steps: each is rounded by half of one,
and the middle one counts twice."""

SMOOTH = 1e-9
"""The same as a share of the signal's range, where a file has all digits."""

BENT = 50.0
"""How far three samples usually are off a straight line, in what rounding makes of one: below, it can't be decided. The
line itself must go further than that: a motion that settles without noise is straight in the end."""

SELDOM = 0.05
"""Share of equal neighbours elsewhere up to which twenty in a row are no chance: 1e-26."""


@dataclass(frozen=True, slots=True)
class NotRead:
    """Rows of a channel that no sensor has read, shape (N,), and what is there instead."""

    channel: str
    rows: BoolArray
    held: bool


def not_read(channel: str, values: FloatArray, seen: BoolArray, may_rest: bool) -> list[NotRead]:
    """Return the rows in which a channel is interpolated, and those in which it is held at one value.

    Parameters
    ----------
    values : ndarray, shape (N,)
    seen : ndarray of bool, shape (N,)
        Which rows were read.
    may_rest : bool
        Whether the channel may stay where it is, whatever that is: a position, the torque of a joint.
    """
    whole = seen[:-2] & seen[1:-1] & seen[2:]
    steps = np.abs(np.diff(values))
    if not whole.any() or not (steps > 0.0).any():
        return []
    rounding = max(ROUNDING * float(steps[steps > 0.0].min()), SMOOTH * float(np.ptp(values[seen])))
    bend = np.abs(np.diff(values, 2))
    bent = bend[whole & (bend > rounding)]
    usual = float(np.median(bent)) if bent.size else 0.0
    if usual < BENT * rounding:
        return []
    drawn, held = np.zeros_like(seen), np.zeros_like(seen)
    for first, behind in _runs(whole & (bend <= rounding)):
        rows = slice(first, behind + 2)  # a triple has two rows more
        if behind + 2 - first < FEWEST_SAMPLES:
            continue
        moved = float(np.ptp(values[rows]))
        drawn[rows] |= moved >= usual
        held[rows] |= moved == 0.0 and values[first] != 0.0
    if may_rest or float(np.mean(steps[~(held[1:] & held[:-1])] == 0.0)) > SELDOM:
        held[:] = False
    return [NotRead(channel, rows, rows is held) for rows in (drawn, held) if rows.any()]


def _runs(rows: BoolArray) -> list[tuple[int, int]]:
    """Return first and behind the last of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], rows.astype(np.int8), [0]])))
    return [(int(first), int(last)) for first, last in edges.reshape(-1, 2)]


def without_not_read(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Mask the rows in which the output was not read; say so.

    A torque that lies on straight lines may be one that was commanded: ramps, and levels.
    """
    mended, warnings = [], []
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
        mended.append(record if np.array_equal(okay, record.okay) else replace(record, okay=okay))
    return mended, warnings
