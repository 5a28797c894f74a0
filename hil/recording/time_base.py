"""The time base of a recording: strictly increasing and uniform, or refused with the place where it is not.

Missing samples are rows of their own (CONTRACT), so a step of twice the period is a fault of the recording,
not a gap to repair here. Jitter of single time stamps is no such fault: the rows still count the periods.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimator.signals.record import uniform_period_s
from hil.errors import RecordingError
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

FEWEST_ROWS = 4 * LEVEL_ROWS
"""Fewer rows are not looked at for jitter."""

COARSER = 1.2
"""Ratio of the least step to the period from which on stamps are rounded: below, one that is repeated is a fault."""

ROUND = 0.01
"""Share of the least step within which all steps are multiples of it, where stamps are rounded."""


def time_base(table: Table, signal: TimeSignal) -> tuple[FloatArray, float, tuple[str, ...]]:
    """Return the time of each row and the sampling period.

    Returns
    -------
    ndarray, shape (N,)
        Time [s], as recorded; without the rounding of stamps coarser than the period, and without wide jitter.
    float
        Sampling period [s].
    tuple of str
        What was done to the stamps; empty where they are as recorded.

    Raises
    ------
    RecordingError
        If there are fewer than two rows, or time is missing, runs backwards, or is not uniform.
    """
    if table.n_rows < 2:
        raise RecordingError(table.path, f"expected two rows or more, got {table.n_rows}. Record longer.")
    if signal.sample_time_s is not None:
        return np.arange(table.n_rows, dtype=np.float64) * signal.sample_time_s, signal.sample_time_s, ()
    column = str(signal.column)
    time = table.numeric([column])[column]
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


def _require_uniform(table: Table, column: str, time: FloatArray) -> None:
    steps = np.diff(time)
    _refuse(table, column, time, 1, ~(steps > 0), "expected a time greater than in the row before")
    period = float(np.median(steps))
    cure = "a missing sample is a row with nan, not a row left out; uneven rows need resample_s in [signals]"
    expected = f"expected a uniform step of {period:.6g} s within {JITTER:.0%} ({cure})"
    _refuse(table, column, time, 1, np.abs(steps - period) > JITTER * period, expected)
    window = min(WINDOW_STEPS, steps.size)
    rates = (time[window:] - time[:-window]) / window
    allowed = (RATE + 2 * JITTER / window) * period
    expected = f"expected a constant rate, a mean step of {period:.6g} s over {window} rows, resample it;"
    _refuse(table, column, time, window, np.abs(rates - period) > allowed, expected)


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
