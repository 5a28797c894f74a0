"""Readings on a grid: what its step is, and the readings in it that were lost without a flag."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
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
from estimator.diagnosis.thresholds import Findings, Noise, Quantised
from estimator.signals.record import BoolArray, FloatArray, OutputKind, Record

BINS_PER_STEP = 8  # fineness of the histogram whose spectrum is searched: it takes 3 % off the finest step's R
PADDING = 4  # points of the spectrum per resolution cell, so that no peak falls between two
MOST_BINS = 2**22  # bins of a spectrum of levels: a finer noise in a wider range shows no lattice that matters


def shorter_runs(rows: BoolArray, longest: int) -> BoolArray:
    """Return the rows that are in a run of at most ``longest``; shape (N,)."""
    kept = rows.copy()
    for begin, end in runs(rows):
        if end - begin > longest:
            kept[begin:end] = False
    return kept


def lattice_step(values: FloatArray) -> float:
    """Return the step of the lattice that values lie on [unit of the values]; tiny where they lie on none."""
    levels = np.unique(values[np.isfinite(values)])
    if levels.size < Quantised.FEWEST_LEVELS:
        return 0.0
    gaps = np.diff(levels)
    gaps = gaps[gaps > Quantised.ROUND_OFF * float(np.abs(levels).max())]
    return float(np.quantile(gaps, Quantised.STEP_QUANTILE, method="lower")) if gaps.size else 0.0


def decimal_place(values: FloatArray) -> float:
    """Return the decimal place that values were rounded to when they were written [their unit], 0 where to none."""
    for decimals in range(Quantised.DECIMALS + 1):
        ticks = values * 10.0**decimals
        off, size = float(np.abs(ticks - np.round(ticks)).max()), float(np.abs(ticks).max())
        if off < Quantised.DECIMAL_OFF * max(1.0, 1e-9 * size):
            return float(10.0**-decimals)
    return 0.0


def speed_quantisation(records: Sequence[Record]) -> AcquisitionFinding | None:
    """Recognise a speed lattice that is not small against the noise; None where there is none."""
    records = [record for record in records if record.kind is OutputKind.SPEED]
    noise = [_one_step_error(record) for record in records]
    known = [sigma for sigma in noise if sigma is not None and sigma > 0.0]
    read = [record.output[np.isfinite(record.output)] for record in records]
    moving = [values[1:][np.diff(values) != 0.0] for values in read]  # rest says nothing of a lattice
    if not known or not any(values.size for values in moving):
        return None
    sigma = float(np.median(known))
    step = _step(moving, sigma)
    if step is None:
        return None
    cells = {}
    for record in records:
        cells[record.name] = no_cells(record)
        cells[record.name][:, OUTPUT] = np.isfinite(record.output)
    return AcquisitionFinding(
        name="speed_quantisation",
        parameters={"step_rad_s": Sized(step.value, step.ci95, "rad/s")},
        cells=cells,
        p_value=step.p_value,
        statement=f"the speed is read in steps of {step.value:.4g} rad/s, {step.value / sigma:.1f} times its noise",
    )


def _one_step_error(record: Record) -> float | None:
    prediction = predict(record, record.okay & np.isfinite(record.output))
    return None if prediction is None else prediction.sigma


@dataclass(frozen=True, slots=True)
class _Step:
    value: float
    ci95: tuple[float, float]
    p_value: float


def _step(moving: Sequence[FloatArray], sigma: float) -> _Step | None:
    values = np.concatenate(moving)
    spread = float(np.median([np.ptp(one) for one in moving if one.size]))
    finest, coarsest = Quantised.NOISE_PER_STEP * sigma, spread / Quantised.LEVELS
    if not finest <= coarsest:
        return None
    candidates = [lattice_step(values), _by_spectrum(values, finest, coarsest)]
    fits = [_refined(values, q) for q in candidates if q is not None and finest <= q <= coarsest]
    best = max(fits, key=lambda fit: fit[1], default=None)
    if best is None:
        return None
    q, regularity, error = best
    smooth = [_smooth(one) for one in moving if one.size > Quantised.SMOOTHING]
    if not smooth:
        return None
    lumps = _regularity(np.concatenate(smooth), q)
    p_value = float(np.exp(-values.size * regularity**2)) * PADDING * float(np.ptp(values)) / finest
    if p_value > Findings.LEVEL or regularity < max(Quantised.REGULAR, Quantised.ABOVE_LUMPS * lumps):
        return None
    return _Step(q, (q - 1.96 * error, q + 1.96 * error), max(p_value, Noise.SMALLEST_P))


def _by_spectrum(values: FloatArray, finest: float, coarsest: float) -> float | None:
    """Return the coarsest step whose lattice the values keep to best; None where there is none to choose from."""
    width = finest / BINS_PER_STEP
    if np.ptp(values) > MOST_BINS * width:
        return None
    bins = np.floor((values - values.min()) / width).astype(np.intp)
    size = 1 << int(np.ceil(np.log2(PADDING * (int(bins.max()) + 1))))
    regularity = np.abs(np.fft.rfft(np.bincount(bins).astype(np.float64), size)) / values.size
    first, last = int(np.ceil(size * width / coarsest)), int(size * width / finest)
    searched = regularity[first : last + 1]
    if searched.size == 0:
        return None
    lowest = int(np.argmax(searched >= Quantised.HARMONIC * searched.max()))
    peak = lowest + int(np.argmax(searched[lowest : lowest + 2 * PADDING]))
    return size * width / (first + peak)


def _refined(values: FloatArray, step: float) -> tuple[float, float, float]:
    """Return the step by least squares of the values on their counts, its R, and its standard error."""
    error = 0.0
    for _ in range(3):
        phase = float(np.angle(np.mean(np.exp(2j * np.pi * values / step)))) / (2.0 * np.pi)
        counts = np.round(values / step - phase)
        step, error = _per_count(values, counts)
    return step, _regularity(values, step), error


def _per_count(values: FloatArray, counts: FloatArray) -> tuple[float, float]:
    """Return what the values grow by per count, by least squares, and its standard error.

    Readings of one level were rounded alike when they were written: their errors are one and not many (the variance of
    clustered errors, Liang and Zeger, Biometrika 73, 1986). It is not below that of rounding alone.
    """
    centred = counts - counts.mean()
    power = float(centred @ centred)
    step = float(centred @ values) / power
    left = values - values.mean() - step * centred
    _, level = np.unique(counts, return_inverse=True)
    of_levels = math.sqrt(float(np.sum(np.bincount(level, centred * left) ** 2)))
    of_rounding = _rounding(values, step) * math.sqrt(float(np.sum(np.bincount(level, centred) ** 2)))
    return step, max(of_levels, of_rounding) / power


def _rounding(values: FloatArray, step: float) -> float:
    """Return the standard deviation of what writing with so many decimals adds to each level of a lattice."""
    place = decimal_place(values)
    return place / math.sqrt(12.0) if place < 0.5 * step else 0.0


def _regularity(values: FloatArray, step: float) -> float:
    return float(np.abs(np.mean(np.exp(2j * np.pi * values / step)))) if values.size else 0.0


def _smooth(values: FloatArray) -> FloatArray:
    return np.convolve(values, np.full(Quantised.SMOOTHING, 1.0 / Quantised.SMOOTHING), mode="valid")


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
    """Return what is lost with the zeros that another channel shows at the same time."""
    whole = [cells.copy() for cells in lost]
    for column in range(max(cells.shape[1] for cells in lost)):
        having = [k for k, cells in enumerate(lost) if cells.shape[1] > column]
        others = [np.any(np.delete(lost[k], column, axis=1), axis=1) for k in having]
        zero = [read[k][:, column] == 0.0 for k in having]
        rows, zeros = np.concatenate(others), np.concatenate(zero)
        usual = float(np.mean(zeros[~rows]))
        if stats.binom.sf(int(zeros[rows].sum()) - 1, int(rows.sum()), usual) <= Findings.LEVEL:
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
    near = max(
        (Quantised.NEAR_STEPS + 0.5) * step, Quantised.NEAR_SHARE * float(np.quantile(np.abs(pooled), Quantised.LARGE))
    )
    rows = [_out_of_line(values, near) for values in series]
    count = sum(int(found.sum()) for found in rows)
    if count < sum(
        int(np.sum((values == 0.0) & ~shorter_runs(values == 0.0, Quantised.LONGEST_ZERO))) for values in series
    ):
        return none, 1.0  # it rests at zero for longer than it would have been lost
    other = float(np.sum((pooled != 0.0) & (np.abs(pooled) <= near)))
    expected = (other + 2.0 * np.sqrt(other + 1.0)) * step / (2.0 * near)
    p_value = float(stats.poisson.sf(count - 1, expected))
    enough = p_value <= Findings.LEVEL and count >= Findings.SMALLEST_SHARE * pooled.size
    if not enough or _has_levels(series, near, count):
        return none, 1.0
    short = [_out_of_line(values, 0.0) for values in series]
    near_zero = sum(int(found.sum()) for found in short) - count
    next_to_zero = pooled[(pooled != 0.0) & (np.abs(pooled) <= (Quantised.NEAR_STEPS + 0.5) * step)]
    usual = max(np.unique(next_to_zero, return_counts=True)[1], default=1)
    found = short if near_zero > Quantised.MORE_THAN_MEANT * usual else rows
    return [inside | _at_ends(values, near, found) for values, inside in zip(series, found, strict=True)], p_value


def _at_ends(values: FloatArray, near: float, found: Sequence[BoolArray]) -> BoolArray:
    longest = max(end - begin for rows in found for begin, end in runs(rows))
    zeros = np.zeros(values.shape, dtype=np.bool_)
    for begin, end in runs(values == 0.0):
        neighbour = values[begin - 1] if begin > 0 else values[min(end, values.size - 1)]
        if (begin == 0 or end == values.size) and end - begin <= longest:
            zeros[begin:end] = abs(neighbour) > near
    return zeros


def _out_of_line(values: FloatArray, near: float) -> BoolArray:
    found = np.zeros(values.shape, dtype=np.bool_)
    for begin, end in runs(values == 0.0):
        if begin > 0 and end < values.size and end - begin <= Quantised.LONGEST_ZERO:
            found[begin:end] = min(abs(values[begin - 1]), abs(values[end])) > near
    return found


def _has_levels(series: Sequence[FloatArray], near: float, count: int) -> bool:
    """Tell whether zero may be one of the signal's own levels: others come alone as often, for short, from afar.

    And as exactly: what a signal jumps to and back is read with its noise, so that values next to it come as well.
    """
    pooled = np.concatenate(series)
    levels, times = np.unique(pooled[np.isfinite(pooled) & (pooled != 0.0)], return_counts=True)
    common = levels[np.argsort(times)[-Quantised.COMMON_LEVELS :]]
    alone = [sum(int(_out_of_line(values - level, near).sum()) for values in series) for level in common]
    exactly = count / _visits(series, near)
    return any(
        rows >= Quantised.AS_OFTEN * count
        and rows >= Quantised.AS_EXACTLY * exactly * _visits([values - level for values in series], near)
        for level, rows in zip(common, alone, strict=True)
    )


def _visits(series: Sequence[FloatArray], near: float) -> int:
    """Return how many values are near zero for a short while, or on their way through it."""
    return sum(int(shorter_runs(np.abs(values) <= near, Quantised.LONGEST_ZERO).sum()) for values in series)


def lost_samples(records: Sequence[Record]) -> AcquisitionFinding | None:
    """Recognise lost readings; None where they are too few to matter."""
    zeros, p_value = lost_zeros(records)
    missing = [_missing(record) for record in records]
    cells = [absent | zero for absent, zero in zip(missing, zeros, strict=True)]
    rows = [np.any(lost, axis=1) for lost in cells]
    count, total = sum(int(lost.sum()) for lost in rows), sum(lost.size for lost in rows)
    if count < Findings.SMALLEST_SHARE * total:
        return None
    share = count / total
    silent = any(zero.any() for zero in zeros)
    how = (
        "recorded as zero without a flag"
        if silent and not any(lost.any() for lost in missing)
        else "missing or flagged"
    )
    return AcquisitionFinding(
        name="lost_samples",
        parameters={"share": Sized(share, share_interval(count, total, mean_run(rows)), "")},
        cells={record.name: lost for record, lost in zip(records, cells, strict=True)},
        p_value=max(p_value, Noise.SMALLEST_P) if silent else Noise.SMALLEST_P,
        statement=f"{100.0 * share:.2g}% of the samples were lost: their rows are {how}",
    )


def _missing(record: Record) -> BoolArray:
    """Return what the recording itself says is missing, gaps left out; shape (N, 1 + M)."""
    lost = ~record.torque_trusted
    whole_row = np.all(lost, axis=1) & ~record.okay
    lost = np.column_stack([~np.isfinite(record.output) | whole_row, lost])
    short = shorter_runs(np.any(lost, axis=1), Quantised.LONGEST_BURST)
    return lost & short[:, np.newaxis]
