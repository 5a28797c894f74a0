"""Lost samples: readings that are missing, flagged, or recorded as zero without a flag."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import stats

from estimator.diagnosis.acquisition.finding import (
    LEVEL,
    SMALLEST_P,
    SMALLEST_SHARE,
    Finding,
    Sized,
    all_of,
    any_of,
    channels,
    mean_run,
    runs,
    share_interval,
    shorter_runs,
)
from estimator.diagnosis.acquisition.quantised import lattice_step
from estimator.signals.record import BoolArray, FloatArray, Record

LONGEST_ZERO = 20
"""More zeros than this in a row are a signal at zero."""

NEAR_STEPS = 5
"""A value near zero is within so many lattice steps of it ..."""

COMMON_LEVELS = 5
"""So many of the commonest other values are looked at, whether they come as zero does."""

AS_EXACTLY = 0.5
"""Of what is near another level for short as large a share must be that level exactly, times this, as for zero."""

NEAR_SHARE = 0.02
"""... or within this share of the channel's size, whichever is more."""

MORE_THAN_MEANT = 5.0
"""Where zeros are lost, those between values near zero are so too if there are so many times as many of them as of any
value next to zero: rounded noise of half a lattice step around zero shows it four times as often as the next value."""


def lost_zeros(records: Sequence[Record]) -> tuple[list[BoolArray], float]:
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
    return _with_their_frames(read, lost), smallest


def _with_their_frames(read: Sequence[FloatArray], lost: Sequence[BoolArray]) -> list[BoolArray]:
    """Return what is lost with the zeros that another channel shows at the same time.

    A row, or a frame with several readings, is lost as a whole. Of a torque that rests at zero, and around it, single
    zeros tell nothing; that it is zero whenever the speed is lost does.
    """
    whole = [cells.copy() for cells in lost]
    for column in range(max(cells.shape[1] for cells in lost)):
        having = [k for k, cells in enumerate(lost) if cells.shape[1] > column]
        others = [any_of(np.delete(lost[k], column, axis=1)) for k in having]
        zero = [read[k][:, column] == 0.0 for k in having]
        rows, zeros = np.concatenate(others), np.concatenate(zero)
        usual = float(np.mean(zeros[~rows]))
        if stats.binom.sf(int(zeros[rows].sum()) - 1, int(rows.sum()), usual) <= LEVEL:
            for k, its_rows, its_zeros in zip(having, others, zero, strict=True):
                whole[k][:, column] |= its_rows & its_zeros
    return whole


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
    other = float(np.sum((pooled != 0.0) & (np.abs(pooled) <= near)))
    expected = (other + 2.0 * np.sqrt(other + 1.0)) * step / (2.0 * near)
    p_value = float(stats.poisson.sf(count - 1, expected))
    enough = p_value <= LEVEL and count >= SMALLEST_SHARE * pooled.size
    if not enough or _has_levels(series, near, count):
        return none, 1.0
    short = [_out_of_line(values, 0.0) for values in series]
    near_zero = sum(int(found.sum()) for found in short) - count
    next_to_zero = pooled[(pooled != 0.0) & (np.abs(pooled) <= (NEAR_STEPS + 0.5) * step)]
    usual = max(np.unique(next_to_zero, return_counts=True)[1], default=1)
    found = short if near_zero > MORE_THAN_MEANT * usual else rows
    return [inside | _at_ends(values, near, found) for values, inside in zip(series, found, strict=True)], p_value


def _at_ends(values: FloatArray, near: float, found: Sequence[BoolArray]) -> BoolArray:
    """Return the zeros a recording begins or ends with, where they are no more in a row than were lost elsewhere."""
    longest = max(end - begin for rows in found for begin, end in runs(rows))
    zeros = np.zeros(values.shape, dtype=np.bool_)
    for begin, end in runs(values == 0.0):
        neighbour = values[begin - 1] if begin > 0 else values[min(end, values.size - 1)]
        if (begin == 0 or end == values.size) and end - begin <= longest:
            zeros[begin:end] = abs(neighbour) > near
    return zeros


def _out_of_line(values: FloatArray, near: float) -> BoolArray:
    """Return the zeros in short runs between values that are not near zero; shape (N,)."""
    found = np.zeros(values.shape, dtype=np.bool_)
    for begin, end in runs(values == 0.0):
        if begin > 0 and end < values.size and end - begin <= LONGEST_ZERO:
            found[begin:end] = min(abs(values[begin - 1]), abs(values[end])) > near
    return found


def _has_levels(series: Sequence[FloatArray], near: float, count: int) -> bool:
    """Tell whether zero may be one of the signal's own levels: others come alone as often, for short, from afar.

    And as exactly: what a signal jumps to and back is read with its noise, so that values next to it come as well.
    """
    pooled = np.concatenate(series)
    levels, times = np.unique(pooled[np.isfinite(pooled) & (pooled != 0.0)], return_counts=True)
    common = levels[np.argsort(times)[-COMMON_LEVELS:]]
    alone = [sum(int(_out_of_line(values - level, near).sum()) for values in series) for level in common]
    exactly = count / _visits(series, near)
    return any(
        rows >= 0.25 * count and rows >= AS_EXACTLY * exactly * _visits([values - level for values in series], near)
        for level, rows in zip(common, alone, strict=True)
    )


def _visits(series: Sequence[FloatArray], near: float) -> int:
    """Return how many values are near zero for a short while, or on their way through it."""
    return sum(int(shorter_runs(np.abs(values) <= near, LONGEST_ZERO).sum()) for values in series)


LONGEST_BURST = 50
"""More missing rows than this in a row are a gap."""


def lost_samples(records: Sequence[Record]) -> Finding | None:
    """Recognise lost readings; None where they are too few to matter."""
    zeros, p_value = lost_zeros(records)
    missing = [_missing(record) for record in records]
    cells = [absent | zero for absent, zero in zip(missing, zeros, strict=True)]
    rows = [any_of(lost) for lost in cells]
    count, total = sum(int(lost.sum()) for lost in rows), sum(lost.size for lost in rows)
    if count < SMALLEST_SHARE * total:
        return None
    share = count / total
    silent = any(zero.any() for zero in zeros)
    how = (
        "recorded as zero without a flag"
        if silent and not any(lost.any() for lost in missing)
        else "missing or flagged"
    )
    return Finding(
        name="lost_samples",
        parameters={"share": Sized(share, share_interval(count, total, mean_run(rows)), "")},
        cells={record.name: lost for record, lost in zip(records, cells, strict=True)},
        p_value=max(p_value, SMALLEST_P) if silent else SMALLEST_P,
        statement=f"{100.0 * share:.2g}% of the samples were lost: their rows are {how}",
    )


def _missing(record: Record) -> BoolArray:
    """Return what the recording itself says is missing, gaps left out; shape (N, 1 + M)."""
    lost = ~record.torque_trusted
    whole_row = all_of(lost) & ~record.okay
    lost = np.column_stack([~np.isfinite(record.output) | whole_row, lost])
    short = shorter_runs(any_of(lost), LONGEST_BURST)
    missing: BoolArray = lost & short[:, np.newaxis]
    return missing
