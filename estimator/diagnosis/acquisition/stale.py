"""Stale samples: readings that repeat the one before, seen by themselves or by what the line answers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import stats

from estimator.diagnosis.acquisition.finding import (
    OUTPUT,
    AcquisitionFinding,
    Sized,
    channels,
    mean_run,
    no_cells,
    predict,
    runs,
    share_interval,
)
from estimator.diagnosis.acquisition.quantised import lattice_step
from estimator.diagnosis.thresholds import Findings, Noise, Quantised, Stale
from estimator.signals.record import BoolArray, FloatArray, Record


@dataclass(frozen=True, slots=True)
class ChanceRepeats:
    """How often a reading equals the one before by chance."""

    expected: float  # best estimate of their number
    upper: float  # most that chance gives, two standard errors above it


def chance_repeats(differences: FloatArray, step: float) -> ChanceRepeats:
    """Predict from differences other than zero how many are zero.

    A Gaussian is drawn through the counts of two bands next to zero, ``0 < |d| <= w`` and ``w < |d| <= 2w``: it has
    ``ln p(d)`` linear in d^2, and locally so has every smooth density that is symmetric about zero.
    """
    size = np.abs(differences)
    moving = size[size > 0.5 * step] if step > 0.0 else size[size > 0.0]
    if moving.size == 0:
        return ChanceRepeats(float(size.size), float(size.size))
    if step <= 0.0:  # without a lattice none is zero by chance
        return ChanceRepeats(0.0, _most_common(differences, step))
    points = max(1, math.floor(float(np.quantile(moving, Quantised.CORE_QUANTILE)) / step + 0.5))
    near = float(np.sum(moving <= (points + 0.5) * step))
    far = float(np.sum(moving <= (2 * points + 0.5) * step)) - near
    # Half an event more keeps the logarithms finite where a band is empty.
    near_rate, far_rate = (near + 0.5) / (2 * points), (far + 0.5) / (2 * points)
    inner, whole = ((n + 1) * (2 * n + 1) / 6.0 for n in (points, 2 * points))  # mean squares of the lags up to n
    lever = inner / (2.0 * (whole - inner))
    slope = max(math.log(near_rate / far_rate), 0.0)
    expected = near_rate * math.exp(lever * slope)
    sampling = math.hypot((1.0 + lever) / math.sqrt(near + 0.5), lever / math.sqrt(far + 0.5))
    upper = max(expected * (1.0 + Quantised.MODEL_ERROR + 2.0 * sampling), _most_common(differences, step))
    return ChanceRepeats(min(expected, float(size.size)), min(upper, float(size.size)))


def _most_common(differences: FloatArray, step: float) -> float:
    """Return how often the most common change other than none occurs."""
    counts = np.round(differences / step) if step > 0.0 else differences
    _, times = np.unique(counts[counts != 0.0], return_counts=True)
    return float(times.max()) if times.size else 0.0


def repeats(values: FloatArray, step: float) -> BoolArray:
    """Return the rows whose reading equals the one before, shape (N,); False in the first and where none was read."""
    found = np.zeros(values.shape, dtype=np.bool_)
    read = values[np.isfinite(values)]
    if read.size:
        found[1:] = np.abs(np.diff(values)) <= Quantised.ROUND_OFF * max(float(np.abs(read).max()), step)
    return found


def flagged(record: Record) -> BoolArray:
    """Return the rows that count in no fit: output not read, or no torque input trusted; shape (N,)."""
    return ~np.isfinite(record.output) | ~np.any(record.torque_trusted, axis=1)


def informative_rows(values: FloatArray, step: float) -> BoolArray:
    """Return the rows of a channel in which a repeat would tell, shape (N,)."""
    change = np.abs(np.diff(values, prepend=np.nan))
    read, again = np.isfinite(change), repeats(values, step)
    informative: BoolArray = read & (_moving_share(read & ~again, read) > 0.5)
    moving = change[informative & ~again]
    if moving.size == 0 or float(np.quantile(moving, Stale.AT_REST)) <= Stale.STEPS_PER_ROW * step:
        return np.zeros_like(informative)
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    for begin, end in runs(again):
        value = values[begin]
        at_rest = abs(value) <= Stale.NEAR_ZERO * max(abs(low), abs(high)) or value in (low, high)
        if end - begin >= Stale.REST_ROWS and at_rest:
            informative[begin:end] = False
    return informative


def _moving_share(moving: BoolArray, read: BoolArray) -> FloatArray:
    """Return the share of the readings around each row that differ from the one before, shape (N,)."""
    counts = [
        sliding_window_view(np.pad(rows, Stale.HALF_WINDOW), 2 * Stale.HALF_WINDOW + 1).sum(axis=1)
        for rows in (moving, read)
    ]
    return counts[0] / np.maximum(counts[1], 1)


@dataclass(frozen=True, slots=True)
class Repeated:
    """What one channel's repeats say."""

    rows: tuple[BoolArray, ...]  # (N,): per recording, rows that repeat where a repeat tells
    total: int  # rows in which a repeat would tell
    expected: float  # repeats by chance among these
    upper: float  # most that chance gives
    catch_up: float  # median change after a repeat, over the usual one

    @property
    def count(self) -> int:
        """Rows that repeat where a repeat tells, in all recordings."""
        return sum(int(rows.sum()) for rows in self.rows)

    @property
    def p_value(self) -> float:
        """Probability of as many repeats by chance: binomial, at the most that chance may do."""
        return float(stats.binom.sf(self.count - 1, self.total, self.upper / self.total)) if self.total else 1.0

    @property
    def is_stale(self) -> bool:
        """Whether they are beyond chance, enough to matter, and caught up with."""
        return (
            self.share(self.count) >= Findings.SMALLEST_SHARE
            and self.p_value <= Findings.LEVEL
            and self.catch_up >= Stale.CATCH_UP
        )

    def share(self, count: float) -> float:
        """Return the share of stale rows behind a count of repeats: those by chance taken off."""
        fresh = self.total - self.expected
        return max(count - self.expected, 0.0) / fresh if fresh > 0.0 else 0.0


def repeated(series: Sequence[FloatArray]) -> Repeated:
    """Look for repeats in one channel of a set of recordings; each array has shape (N,), NaN where nothing was read."""
    rows, after, usual = [], [], []
    total, expected, upper = 0, 0.0, 0.0
    for values in series:
        step = lattice_step(values)
        informative = informative_rows(values, step)
        again = repeats(values, step) & informative
        change = np.diff(values, prepend=np.nan)
        chance = chance_repeats(change[informative], step)
        rows.append(again)
        total, expected, upper = total + int(informative.sum()), expected + chance.expected, upper + chance.upper
        follows = _follows(again)
        after.append(np.abs(change[follows & np.isfinite(change)]))
        usual.append(np.abs(change[informative & ~again & ~follows]))
    return Repeated(tuple(rows), total, expected, upper, _ratio(np.concatenate(after), np.concatenate(usual)))


def _follows(again: BoolArray) -> BoolArray:
    """Return the rows right after runs of repeats, shape (N,)."""
    follows = np.zeros_like(again)
    for _, end in runs(again):
        if end < again.size:
            follows[end] = True
    return follows


def _ratio(after: FloatArray, usual: FloatArray) -> float:
    return float(np.median(after) / np.median(usual)) if after.size and usual.size else 0.0


@dataclass(frozen=True, slots=True)
class LateTorque:
    """What one recording says of some torque inputs together."""

    rows: BoolArray  # (N,): rows whose torques repeat while the output answers the next one
    early: int  # clear steps that were answered early, of those before which the torque repeats
    repeats: int  # clear steps before which the torque repeats
    early_others: int  # the same of those before which it does not
    others: int  # clear steps before which it does not


def late_torque(record: Record, inputs: Sequence[int], trusted: BoolArray) -> LateTorque | None:
    """Examine torque inputs that may be stale in the same rows; None where no predictor can be fitted."""
    torque = record.torque_nm[:, inputs].sum(axis=1)
    read = np.all(record.torque_trusted[:, inputs], axis=1)
    again = read & np.all(np.column_stack([_repeats(record.torque_nm[:, i]) for i in inputs]), axis=1)
    step = np.append(np.where(read[1:], np.diff(torque), 0.0), 0.0)  # from this row to the next
    found, stale = None, np.zeros_like(read)
    for clear in Stale.CLEAR:
        prediction = predict(_mended(record, inputs, stale), trusted)
        if prediction is None or prediction.gain == 0.0:
            return None
        early = np.full(torque.size, np.nan)  # torque beyond the recorded that the next output speaks of
        early[prediction.rows - 1] = prediction.error / prediction.gain
        early += _next_fresh(torque, stale) - torque  # which the predictor was given already
        found = _late(again, step, early, np.abs(step * prediction.gain) > clear * prediction.typical)
        stale = found.rows
    return found


def _repeats(torque: FloatArray) -> BoolArray:
    return repeats(torque, lattice_step(torque))


def _late(again: BoolArray, step: FloatArray, early: FloatArray, clear: BoolArray) -> LateTorque:
    """Compare the clear steps after repeats with the others, and follow a burst of repeats back to its beginning."""
    clear = clear & np.isfinite(early)
    answered = np.zeros_like(clear)
    answered[clear] = early[clear] / step[clear] > Stale.ANSWERED
    rows = np.zeros_like(clear)
    for last in np.flatnonzero(answered & again):
        row = int(last)
        while row > 0 and again[row] and early[row] / step[last] > Stale.ANSWERED:
            rows[row] = True
            row -= 1
    counts = (answered & again, clear & again, answered & ~again, clear & ~again)
    return LateTorque(rows, *(int(count.sum()) for count in counts))


def _next_fresh(torque: FloatArray, stale: BoolArray) -> FloatArray:
    rows = np.where(stale, torque.size - 1, np.arange(torque.size))
    return torque[np.minimum.accumulate(rows[::-1])[::-1]]


def _mended(record: Record, inputs: Sequence[int], stale: BoolArray) -> Record:
    torque = record.torque_nm.copy()
    for i in inputs:
        torque[:, i] = _next_fresh(torque[:, i], stale)
    return replace(record, torque_nm=torque)


def pooled_p_value(found: Sequence[LateTorque]) -> float:
    """Return the probability of so many early answers after repeats, if they were as common as elsewhere.

    Elsewhere in the same recording: where the predictor follows one worse than the others, that one has more of both.
    Above its mean a sum of binomials is at most as far out as Poisson's law of that mean (Hoeffding, Ann. Math. Stat.
    27, 1956); that probability is returned.
    """
    usual = sum(late.repeats * (late.early_others + 1.0) / (late.others + 2.0) for late in found)
    return float(stats.poisson.sf(sum(late.early for late in found) - 1, usual))


Cells = dict[str, BoolArray]
Size = tuple[float, tuple[float, float], float]
"""Share of stale samples, its 95 % interval, and the probability of as many by chance."""


def stale_samples(records: Sequence[Record]) -> AcquisitionFinding | None:
    """Recognise readings that repeat the one before, in any channel; None where chance explains the repeats."""
    cells = {record.name: no_cells(record) for record in records}
    sizes: dict[str, Size] = {}
    output = _of_output(records, cells)
    if output is not None:
        sizes[records[0].kind.value] = output
    sizes |= _of_torques(records, cells)
    if not sizes:
        return None
    value, ci95, _ = max(sizes.values())
    return AcquisitionFinding(
        name="stale_samples",
        parameters={"share": Sized(value, ci95, "")},
        cells=cells,
        p_value=max(min(size[2] for size in sizes.values()), Noise.SMALLEST_P),
        statement=_statement(value, tuple(sizes), records),
    )


def _statement(share: float, names: tuple[str, ...], records: Sequence[Record]) -> str:
    inputs = max(record.torque_nm.shape[1] for record in records)
    where = "whole rows" if len(names) == 1 + inputs else " and ".join(names)
    return f"{100.0 * share:.2g}% of the samples are stale: the previous value is repeated without a flag in {where}"


def _of_output(records: Sequence[Record], cells: Cells) -> Size | None:
    read = [np.where(flagged(record), np.nan, record.output) for record in records]
    found = repeated(read)
    size = _size(found)
    if size is not None:
        for record, rows in zip(records, found.rows, strict=True):
            cells[record.name][:, OUTPUT] = rows
    return size


def _size(found: Repeated) -> Size | None:
    if not found.is_stale:
        return None
    low, high = share_interval(found.count, found.total, mean_run(list(found.rows)))
    ci95 = (found.share(low * found.total), found.share(high * found.total))
    return found.share(found.count), ci95, found.p_value


def _of_torques(records: Sequence[Record], cells: Cells) -> dict[str, Size]:
    """Look at every torque input: with the output, by the output's answer, or by its own repeats, whichever tells."""
    sizes: dict[str, Size] = {}
    every = tuple(range(min(record.torque_nm.shape[1] for record in records)))
    for i in every:
        size = _with_output(records, i, cells)
        if size is not None:
            sizes[f"torque {i + 1}"] = size
    left = tuple(i for i in every if f"torque {i + 1}" not in sizes)
    together = _by_answer(records, left, cells) if len(left) > 1 else None
    for i in left:
        size = together or _by_answer(records, (i,), cells) or _by_itself(records, i, cells)
        if size is not None:
            sizes[f"torque {i + 1}"] = size
    return sizes


def _with_output(records: Sequence[Record], i: int, cells: Cells) -> Size | None:
    """Tell whether a torque repeats in the output's stale rows more often than in others."""
    stale, fresh = [], []
    again = [_torque_repeats(record, i) for record in records]
    for record, repeat in zip(records, again, strict=True):
        rows, read = cells[record.name][:, OUTPUT], record.torque_trusted[:, i]
        stale.append(repeat[rows & read])
        fresh.append(repeat[~rows & read])
    joint, others = np.concatenate(stale), np.concatenate(fresh)
    if joint.size == 0:
        return None
    usual = (float(others.sum()) + 1.0) / (others.size + 2.0)
    p_value = float(stats.binom.sf(int(joint.sum()) - 1, joint.size, usual))
    share = float(joint.sum()) / sum(record.okay.size for record in records)
    if not (p_value <= Findings.LEVEL and share >= Findings.SMALLEST_SHARE):
        return None
    for record, repeat in zip(records, again, strict=True):
        cells[record.name][:, 1 + i] = repeat & cells[record.name][:, OUTPUT]
    rows_of = [cells[record.name][:, 1 + i] for record in records]
    total = sum(record.okay.size for record in records)
    return share, share_interval(float(joint.sum()), total, mean_run(rows_of)), p_value


def _torque_repeats(record: Record, i: int) -> BoolArray:
    values = channels(record)[:, 1 + i]
    return repeats(values, lattice_step(values))


def _by_itself(records: Sequence[Record], i: int, cells: Cells) -> Size | None:
    """Tell by the repeats alone, as for the output; possible where the torque's noise is well above its resolution."""
    found = repeated([channels(record)[:, 1 + i] for record in records])
    size = _size(found)
    if size is not None:
        for record, rows in zip(records, found.rows, strict=True):
            cells[record.name][:, 1 + i] = rows
    return size


def _by_answer(records: Sequence[Record], inputs: tuple[int, ...], cells: Cells) -> Size | None:
    """Tell by the output's answer to steps that are recorded late."""
    found: dict[str, LateTorque] = {}
    for record in records:
        trusted = record.okay & np.isfinite(record.output) & ~cells[record.name][:, OUTPUT]
        late = late_torque(record, inputs, trusted)
        if late is not None:
            found[record.name] = late
    steps = sum(late.repeats + late.others for late in found.values())
    count = sum(late.early for late in found.values())
    p_value = pooled_p_value(list(found.values()))
    if not (count >= Findings.SMALLEST_SHARE * max(steps, 1) and p_value <= Findings.LEVEL):
        return None
    for name, late in found.items():
        for i in inputs:
            cells[name][:, 1 + i] = late.rows
    return count / steps, share_interval(count, steps), p_value
