"""Lost samples: readings that are missing, flagged, or recorded as zero without a flag.

Rows that a mask of the model file takes out were read well; they are the choice of whoever wrote it. And where nothing
was read for long, the recording has a gap, which is no matter of single samples.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import stats

from estimator.diagnosis.acquisition.finding import Finding, Sized
from estimator.diagnosis.acquisition.lattice import lattice_step
from estimator.diagnosis.acquisition.limits import LEVEL, SMALLEST_P, SMALLEST_SHARE
from estimator.diagnosis.acquisition.readings import (
    all_of,
    any_of,
    channels,
    mean_run,
    runs,
    share_interval,
    shorter_runs,
)
from estimator.signals.record import BoolArray, FloatArray, Record

LONGEST_BURST = 50
"""More missing rows than this in a row are a gap."""

LONGEST_ZERO = 20
"""More zeros than this in a row are a signal at zero."""

NEAR_STEPS = 5
"""A value near zero is within so many lattice steps of it ..."""

COMMON_LEVELS = 5
"""So many of the commonest other values are looked at, whether they come as zero does."""

NEAR_SHARE = 0.02
"""... or within this share of the channel's size, whichever is more."""

MORE_THAN_MEANT = 5.0
"""Where zeros are lost, those between values near zero are so too if there are so many times as many of them as of any
value beside zero: rounded noise of half a lattice step around zero shows it four times as often as the next value."""


def lost_samples(records: Sequence[Record]) -> Finding | None:
    """Recognise lost readings; None where they are too few to matter."""
    zeros, p_value = _lost_zeros(records)
    told = [_told(record) for record in records]
    cells = [missing | zero for missing, zero in zip(told, zeros, strict=True)]
    rows = [any_of(lost) for lost in cells]
    count, total = sum(int(lost.sum()) for lost in rows), sum(lost.size for lost in rows)
    if count < SMALLEST_SHARE * total:
        return None
    share = count / total
    silent = any(zero.any() for zero in zeros)
    how = "recorded as zero without a flag" if silent and not any(lost.any() for lost in told) else "missing or flagged"
    return Finding(
        name="lost_samples",
        parameters={"share": Sized(share, share_interval(count, total, mean_run(rows)), "")},
        cells={record.name: lost for record, lost in zip(records, cells, strict=True)},
        p_value=max(p_value, SMALLEST_P) if silent else SMALLEST_P,
        statement=f"{100.0 * share:.2g}% of the samples were lost: their rows are {how}",
    )


def _told(record: Record) -> BoolArray:
    """Return what the recording itself says is missing, gaps left out; shape (N, 1 + M)."""
    lost = ~record.torque_trusted
    whole_row = all_of(lost) & ~record.okay
    lost = np.column_stack([~np.isfinite(record.output) | whole_row, lost])
    short = shorter_runs(any_of(lost), LONGEST_BURST)
    told: BoolArray = lost & short[:, np.newaxis]
    return told


def _lost_zeros(records: Sequence[Record]) -> tuple[list[BoolArray], float]:
    """Return the readings that are zero and shouldn't be, each (N, 1 + M), and the probability by chance."""
    read = [channels(record) for record in records]
    lost = [np.zeros(values.shape, dtype=np.bool_) for values in read]
    smallest = 1.0
    for column in range(max(values.shape[1] for values in read)):
        having = [k for k, values in enumerate(read) if values.shape[1] > column]
        found, p_value = _zeros_of([read[k][:, column] for k in having])
        for k, rows in zip(having, found, strict=True):
            lost[k][:, column] = rows
        smallest = min(smallest, p_value)
    return lost, smallest


def _zeros_of(series: Sequence[FloatArray]) -> tuple[list[BoolArray], float]:
    """Look at one channel: zeros far above the density of other values near zero, out of line with their neighbours."""
    none = [np.zeros(values.shape, dtype=np.bool_) for values in series]
    pooled = np.concatenate(series)
    pooled = pooled[np.isfinite(pooled)]
    step = lattice_step(pooled)
    if step == 0.0:
        return none, 1.0
    near = max((NEAR_STEPS + 0.5) * step, NEAR_SHARE * float(np.quantile(np.abs(pooled), 0.9)))
    rows = [_out_of_line(values, near) for values in series]
    count = sum(int(found.sum()) for found in rows)
    if count < sum(int(np.sum((values == 0.0) & ~shorter_runs(values == 0.0, LONGEST_ZERO))) for values in series):
        return none, 1.0  # it rests at zero for longer than it would have been lost
    beside = float(np.sum((pooled != 0.0) & (np.abs(pooled) <= near)))
    expected = (beside + 2.0 * np.sqrt(beside + 1.0)) * step / (2.0 * near)
    p_value = float(stats.poisson.sf(count - 1, expected))
    enough = p_value <= LEVEL and count >= SMALLEST_SHARE * pooled.size
    if not enough or _has_levels(series, near, count):
        return none, 1.0
    short = [_out_of_line(values, 0.0) for values in series]
    near_zero = sum(int(found.sum()) for found in short) - count
    beside_zero = pooled[(pooled != 0.0) & (np.abs(pooled) <= (NEAR_STEPS + 0.5) * step)]
    usual = max(np.unique(beside_zero, return_counts=True)[1], default=1)
    return (short if near_zero > MORE_THAN_MEANT * usual else rows), p_value


def _out_of_line(values: FloatArray, near: float) -> BoolArray:
    """Return the zeros in short runs between values that are not near zero; shape (N,)."""
    found = np.zeros(values.shape, dtype=np.bool_)
    for begin, end in runs(values == 0.0):
        if begin > 0 and end < values.size and end - begin <= LONGEST_ZERO:
            found[begin:end] = min(abs(values[begin - 1]), abs(values[end])) > near
    return found


def _has_levels(series: Sequence[FloatArray], near: float, count: int) -> bool:
    """Tell whether zero may be one of the signal's own levels: others come alone as often, for short, from afar."""
    pooled = np.concatenate(series)
    levels, times = np.unique(pooled[np.isfinite(pooled) & (pooled != 0.0)], return_counts=True)
    common = levels[np.argsort(times)[-COMMON_LEVELS:]]
    alone = [sum(int(_out_of_line(values - level, near).sum()) for values in series) for level in common]
    return max(alone, default=0) >= 0.25 * count
