"""Channels of different or uneven rates, brought to one period: never unasked, and with what was done to each.

Where a channel is thinned, a low-pass comes first (linear phase, Hamming window, edge at the new Nyquist frequency, as
`estimator.signals.decimate` has it), without delay: what is faster would fold into what is slow. Between two samples
lies a straight line, or the first of them is held, as the channel says. A gap is missing samples.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimator.signals.record import uniform_period_s
from hil.errors import RecordingError
from hil.recording.bounds import require_cells
from hil.recording.channels import are_row_numbers
from hil.recording.scales import Role, scale_of
from hil.recording.signals_config import TimeSignal
from hil.recording.table import FloatArray, Table

JITTER = 0.5
"""A single step may differ from the period by this share of it; beyond, a row is missing or one too many."""

RATE = 0.02
"""The mean step of a window may differ from the period by this share; beyond, the rate itself changes."""

WINDOW_STEPS = 100
"""Long enough that jitter of the window's two ends, up to half a period each, is within 1 % of its length."""


LEVEL_ROWS = 11
"""Rows before and behind a step whose median tells whether a row is missing there: jitter is as wide at most."""

FEWEST_ROWS = 4 * LEVEL_ROWS  # fewer rows are not looked at for jitter

COARSER = 1.2
"""Ratio of the least step to the period from which on stamps are rounded: below, one that is repeated is a fault."""

ROUND = 0.01  # share of the least step within which all steps are multiples of it, where stamps are rounded

EDGE, HALF_LENGTH = 1.0, 8
"""Of the low-pass: in new Nyquist frequencies, and in new periods; as in `estimator.signals.decimate`."""

GAP: Final = 2.5
"""Distance of two samples, in the channel's own period, beyond which those between are missing: jitter is less."""

THINS: Final = 1.5  # ratio of the new period to the channel's own from which on it is thinned
MOST_RATIO: Final = 10_000  # of both periods; the low-pass has 16 times as many taps
HALF: Final = 0.5  # weight of present samples in the low-pass below which the result is missing


def time_base(table: Table, signal: TimeSignal) -> tuple[FloatArray, float, tuple[str, ...]]:
    """Return the time of each row and the sampling period."""
    if table.n_rows < 2:
        raise RecordingError(table.path, f"expected two rows or more, got {table.n_rows}. Record longer.")
    if signal.sample_time_s is not None:
        return np.arange(table.n_rows, dtype=np.float64) * signal.sample_time_s, signal.sample_time_s, ()
    column = str(signal.column)
    time = table.numeric([column])[column]
    if signal.given_scale is None and not table.units.get(column) and are_row_numbers(time):
        raise RecordingError(
            table.path,
            f"column {column}: expected the time of each row, got the numbers of the rows. Write the true period: "
            "time = { sample_time_s = ... }; or, where rows are seconds, scale = 1.0.",
        )
    time *= scale_of(table, column, Role.TIME, signal.given_scale)
    straight = straightened(time)
    if straight is not None:
        period = uniform_period_s(straight)
        return straight, period, (f"{column}: stamps that jitter or are rounded; rows every {period:.6g} s",)
    _require_uniform(table, column, time)
    return time, uniform_period_s(time), ()


def straightened(time: FloatArray) -> FloatArray | None:
    """Return uniform times behind stamps that are rounded to more than a period, or that jitter by half of one or more.

    None where the stamps are good as they are, or rows may be missing: about a missing row the stamps before and the
    stamps behind are off by a period from one another, for good.
    """
    steps = np.diff(time)
    if not (steps >= 0.0).all() or time.size < FEWEST_ROWS:
        return None
    period = uniform_period_s(time)
    usual = float(np.median(steps))
    if (steps > 0.0).all() and (np.abs(steps - usual) <= JITTER * usual).all():
        return None
    line: FloatArray = time.mean() + period * (np.arange(time.size) - 0.5 * (time.size - 1))
    off = time - line
    resolution = float(steps[steps > 0.0].min(initial=np.inf))
    is_rounded = bool((np.abs(np.round(steps / resolution) * resolution - steps) < ROUND * resolution).all())
    if is_rounded and resolution >= COARSER * period and float(np.ptp(off)) <= 2.0 * resolution:
        return line
    if resolution == 0.0 or (steps == 0.0).any() or float(np.ptp(off)) > 2.0 * period:
        return None
    return line if float(np.abs(_change_of_level(off)).max()) <= JITTER * period else None


def _change_of_level(off: FloatArray) -> FloatArray:
    """Return by how much the stamps behind each step are later than those before, in the median; shape (N - 1,)."""
    from scipy.ndimage import median_filter  # which few recordings need

    padded = np.pad(off, LEVEL_ROWS, mode="edge")
    medians = median_filter(padded, LEVEL_ROWS)
    middle = LEVEL_ROWS // 2
    before = medians[LEVEL_ROWS - middle : LEVEL_ROWS - middle + off.size - 1]
    behind = medians[LEVEL_ROWS + 1 + middle : LEVEL_ROWS + middle + off.size]
    change: FloatArray = behind - before
    return change


def is_uniform(time: FloatArray) -> bool:
    """Tell whether times are read as they are; shape (N,), two or more."""
    return not any(wrong.any() for _, wrong, _ in _uneven(time))


def _require_uniform(table: Table, column: str, time: FloatArray) -> None:
    for span, wrong, expected in _uneven(time):
        _refuse(table, column, time, span, wrong, expected)


def _uneven(time: FloatArray) -> Iterator[tuple[int, NDArray[np.bool_], str]]:
    """Yield what makes times uneven: the rows between which it is asked, where it is so, and what was expected."""
    steps = np.diff(time)
    yield 1, ~(steps > 0), "expected a time greater than in the row before"
    period = float(np.median(steps))
    cure = "a missing sample is a row with nan, not a row left out; uneven rows need resample_s in [signals]"
    expected = f"expected a uniform step of {period:.6g} s within {JITTER:.0%} ({cure})"
    yield 1, np.abs(steps - period) > JITTER * period, expected
    window = min(WINDOW_STEPS, steps.size)
    rates = (time[window:] - time[:-window]) / window
    allowed = (RATE + 2 * JITTER / window) * period
    expected = f"expected a constant rate, a mean step of {period:.6g} s over {window} rows, resample it;"
    yield window, np.abs(rates - period) > allowed, expected


def _refuse(table: Table, column: str, time: FloatArray, span: int, wrong: NDArray[np.bool_], expected: str) -> None:
    """Refuse the first span of rows that is wrong; the one that starts at row k leads to row k + span."""
    found = np.flatnonzero(wrong)
    if found.size:
        row = int(found[0]) + span
        before = "the row before" if span == 1 else f"{span} rows before"
        raise RecordingError(
            table.path,
            f"{table.place(row)}, column {column}: {expected}, got {time[row]:.9g} s "
            f"after {time[row - span]:.9g} s in {before}",
        )


@dataclass(frozen=True, slots=True)
class Series:
    """A channel with times of its own, shapes (n,); NaN is missing, and ``held`` a value counts until the next."""

    time_s: FloatArray  # of the recording
    values: FloatArray  # in whatever unit: none is converted here
    held: bool = False

    @property
    def period_s(self) -> float:
        """The usual distance of two samples [s]."""
        return float(np.median(np.diff(self.time_s))) if self.time_s.size > 1 else math.inf


def resampled(
    path: Path, series: Mapping[str, Series], period_s: float
) -> tuple[FloatArray, dict[str, FloatArray], list[str]]:
    """Bring channels to one period, over the time that all of them have."""
    usable = {name: _in_order(path, name, one) for name, one in series.items()}
    start = max(float(one.time_s[0]) for one in usable.values())
    end = min(float(one.time_s[-1]) for one in usable.values())
    count = math.floor((end - start) / period_s + 1e-6) + 1
    if count < 2:
        raise RecordingError(
            path,
            f"expected channels with {period_s:g} s in common for resample_s, got the last start at {start:.6g} s "
            f"and the first end at {end:.6g} s",
        )
    require_cells(path, count * (len(usable) + 1))
    time: FloatArray = start + period_s * np.arange(count, dtype=np.float64)
    columns, remarks = {}, []
    for name, one in usable.items():
        columns[name], done = _brought(path, name, one, time, period_s)
        remarks.append(f"{name}: {one.period_s:.4g} s brought to {period_s:g} s, {done}")
    return time, columns, remarks


def _in_order(path: Path, name: str, one: Series) -> Series:
    """Leave out missing values, and of samples at one time all but the last."""
    present = np.isfinite(one.values) & np.isfinite(one.time_s)
    time, values = one.time_s[present], one.values[present]
    if time.size < 2:
        raise RecordingError(path, f"column {name}: expected two samples or more, got {time.size}")
    steps = np.diff(time)
    if (steps < 0).any():
        row = int(np.flatnonzero(steps < 0)[0])
        raise RecordingError(
            path, f"column {name}: expected times that run forward, got {time[row + 1]:.9g} s after {time[row]:.9g} s"
        )
    last = np.append(steps > 0, True)
    return Series(time[last], values[last], one.held)


def _brought(path: Path, name: str, one: Series, time: FloatArray, period_s: float) -> tuple[FloatArray, str]:
    if one.held:
        rows = np.searchsorted(one.time_s, time, side="right") - 1
        return one.values[np.maximum(rows, 0)], "the last value held"
    ratio = period_s / one.period_s
    if ratio < THINS:
        return _linear(one, time, one.period_s), "straight lines between its samples"
    if ratio > MOST_RATIO:
        raise RecordingError(
            path, f"column {name}: expected resample_s of at most {MOST_RATIO} of its periods, got {ratio:.0f}"
        )
    require_cells(path, time.size * math.ceil(ratio))
    return _thinned(one, time, period_s, math.ceil(ratio)), f"low-pass at {0.5 * EDGE / period_s:.4g} Hz and thinned"


def _linear(one: Series, time: FloatArray, period_s: float) -> FloatArray:
    values: FloatArray = np.interp(time, one.time_s, one.values)
    after = np.clip(np.searchsorted(one.time_s, time, side="left"), 1, one.time_s.size - 1)
    width = one.time_s[after] - one.time_s[after - 1]
    on_one = (time == one.time_s[after]) | (time == one.time_s[after - 1])
    values[(width > GAP * period_s) & ~on_one] = np.nan
    return values


def _thinned(one: Series, time: FloatArray, period_s: float, factor: int) -> FloatArray:
    """Return every so-manieth value of the low-passed channel; what is missing has no weight in the low-pass."""
    from scipy.signal import fftconvolve, firwin  # half a second that few recordings need

    reach = HALF_LENGTH * factor
    fine = time[0] + period_s / factor * np.arange(-reach, (time.size - 1) * factor + reach + 1)
    values = _linear(one, fine, one.period_s)
    values[(fine < one.time_s[0]) | (fine > one.time_s[-1])] = np.nan
    present = np.isfinite(values)
    level = float(values[present].mean())
    taps = firwin(2 * reach + 1, EDGE / factor, window="hamming")
    kept = slice(None, None, factor)
    sums = fftconvolve(np.where(present, values - level, 0.0), taps, mode="valid")[kept]
    weights = fftconvolve(present.astype(np.float64), taps, mode="valid")[kept]
    seen = weights > HALF
    out = np.full(time.size, np.nan)
    out[seen] = level + sums[seen] / weights[seen]
    return out
