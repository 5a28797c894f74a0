"""What a channel alone says against its role: dead, clipped, named twice, turned against another; row numbers as time.

`hil look` and `hil diagnose` say the same words, for both read by `hil.recording.signals`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hil.errors import RecordingError
from hil.recording.table import FloatArray, Table

CANCELS: Final = 0.01
"""Ratio of the spread of a sum of torques to theirs below which they cancel: two readings differ by more."""

CLIPPED_SHARE: Final = 0.01
CLIPPED_RUN: Final = 3
"""A reading is clipped where its greatest or least value stands that often in a row, in that share of the rows."""

DISTINCT: Final = 50
"""Fewer values are steps of a coarse reading or of a square wave, and their greatest stands for long by itself."""


def require_plausible_torques(table: Table, names: Sequence[str], values: Mapping[str, FloatArray]) -> None:
    """Refuse inputs of which one counts twice, or that take one another away."""
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise RecordingError(
            table.path,
            f"column {twice}: expected every torque once, got it twice in [signals] torque: it would count double. "
            "Name the other inverter's column, or leave one out and give scale = 2.",
        )
    spreads = [float(np.nanstd(values[name])) for name in names]
    if len(names) == 2 and min(spreads) > 0.0:
        total = values[names[0]] + values[names[1]]
        if float(np.nanstd(total)) < CANCELS * min(spreads) and abs(float(np.nanmean(total))) < CANCELS * min(spreads):
            raise RecordingError(
                table.path,
                f"columns {names[0]} and {names[1]}: expected torques that add up, got two that cancel in every row. "
                f"One has the other sign: write {{ column = {names[0]!r}, scale = -1.0 }} for the one that is turned.",
            )


def doubts(torques: Sequence[str], output: str, values: Mapping[str, FloatArray]) -> Iterator[str]:
    """Say what is odd about the channels that are read; a line each."""
    for name in torques:
        if len(torques) > 1 and not np.nan_to_num(values[name]).any():
            yield f"{name}: 0 in every row. Was that inverter off, or is the channel dead?"
    for name in (*torques, output):
        if bound := clipped_at(values[name]):
            share, value = bound
            yield f"{name}: {share:.0%} of the rows stand at {value:g}, as a reading that is clipped does"


def clipped_at(values: FloatArray) -> tuple[float, float] | None:
    """Return which share of the rows stands at the greatest or least value, and that; else None."""
    seen = values[np.isfinite(values)]
    rows = clipped_rows(seen)
    return (float(rows.mean()), float(seen[rows][0])) if rows.any() else None


def clipped_rows(values: FloatArray) -> NDArray[np.bool_]:
    """Tell which rows stand at the greatest value, or else the least, as a reading that is clipped does; shape (N,)."""
    clipped = np.zeros(values.size, dtype=np.bool_)
    seen = values[np.isfinite(values)]
    if np.unique(seen).size < DISTINCT:
        return clipped
    for bound in (float(seen.max()), float(seen.min())):
        edges = np.diff(np.concatenate([[0], (values == bound).astype(np.int8), [0]]))
        runs = zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True)
        for first, end in runs:
            clipped[first:end] = end - first >= CLIPPED_RUN
        if clipped.sum() > CLIPPED_SHARE * seen.size:
            return clipped
        clipped[:] = False
    return clipped
