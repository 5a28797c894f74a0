"""Channels that ran into a limit of their reading: a value stands at the end of the range as no other value does.

A signal that merely turns round also rests on its outermost level, where it is read in steps of q: a smooth peak
``y = -a t^2 / 2`` is up to ``2 sqrt(2 q / a)`` on the top step and twice ``(sqrt(2) - 1) sqrt(2 q / a)`` on the next,
at most 2.4 times as often on the top one. A value that comes ten times as often as any other is no such peak.
Nor is it a motion that has settled: that one slows down before it comes to its last value, a signal that is cut off
does not. Zero is rest. A command that is held at several values has several such values, and is not cut off either.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.signals.record import BoolArray, FloatArray, Record

FEWEST_SAMPLES = 10
"""Rows at the limit that count."""

FEWEST_LEVELS = 10
"""A channel of fewer values is switched."""

SMALLEST_SHARE = 0.005
"""Share of the rows that must stand at the limit: fewer change no fit."""

OFTEN = 10.0
"""How often the limit must come over any other value: four times what a smooth peak read in steps can have."""

AT_PACE = 0.1
"""Step before the signal comes to the limit, in its usual steps (medians): below, it settles there."""


@dataclass(frozen=True, slots=True)
class Clipped:
    """One channel at one limit: the value, and in which rows it stands there, shape (N,)."""

    channel: str
    value: float
    rows: BoolArray


def clipped(channel: str, values: FloatArray, seen: BoolArray) -> list[Clipped]:
    """Return the limits at which a channel is cut off, of its largest and its smallest value.

    Parameters
    ----------
    values : ndarray, shape (N,)
    seen : ndarray of bool, shape (N,)
        Which rows were read.
    """
    levels, counts = np.unique(values[seen], return_counts=True)
    if levels.size < FEWEST_LEVELS:
        return []
    others = counts[1:-1][levels[1:-1] != 0.0]
    found = []
    for end in (0, -1):
        limit = float(levels[end])
        often = counts[end] >= max(FEWEST_SAMPLES, SMALLEST_SHARE * values.size, OFTEN * others.max(initial=1))
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
    return bool(comes.size and usual.size and np.median(comes) >= AT_PACE * np.median(usual))


def without_clipped(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Mask the rows in which the output is cut off; say so, and say where a torque seems to be.

    A torque that stands at its limit may be cut off in the reading or held there by the drive; the reading
    alone doesn't show which, so its rows stay.
    """
    mended, warnings = [], []
    for record in records:
        okay = record.okay.copy()
        for found in clipped(record.kind.value, record.output, record.okay & np.isfinite(record.output)):
            okay &= ~found.rows
            warnings.append(
                f"recording {record.name}: the {found.channel} stands at its limit {found.value:g} in "
                f"{found.rows.mean():.1%} of the rows: its reading is cut off there; these rows are not used. "
                "Widen the range of the sensor or of its scale."
            )
        mended.append(record if np.array_equal(okay, record.okay) else replace(record, okay=okay))
        warnings += _torques(record)
    return mended, warnings


def _torques(record: Record) -> list[str]:
    trusted = record.torque_trusted
    return [
        f"recording {record.name}: {found.channel} stands at its limit {found.value:g} in {found.rows.mean():.1%} of "
        "the rows. If the drive limited it, the reading is right; if the reading is cut off, the verdict can't be "
        "trusted: mask these rows ([signals] mask) or widen the range."
        for i in range(record.torque_nm.shape[1])
        for found in clipped(f"torque input {i + 1}", record.torque_nm[:, i], trusted[:, i])
    ]
