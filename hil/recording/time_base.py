"""The time base of a recording: strictly increasing and uniform, or refused with the place where it is not.

Missing samples are rows of their own (CONTRACT), so a step of twice the period is a fault of the recording,
not a gap to repair here. Jitter of single time stamps is no such fault: the rows still count the periods.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimator.signals.time_stamps import uniform_period_s
from hil.errors import RecordingError
from hil.recording.signals_config import TimeSignal
from hil.recording.table import FloatArray, Table

JITTER = 0.5
"""A single step may differ from the period by this share of it; beyond, a row is missing or one too many."""

RATE = 0.02
"""The mean step of a window may differ from the period by this share; beyond, the rate itself changes."""

WINDOW_STEPS = 100
"""Long enough that jitter of the window's two ends, up to half a period each, is within 1 % of its length."""


def time_base(table: Table, signal: TimeSignal) -> tuple[FloatArray, float]:
    """Return the time of each row and the sampling period.

    Returns
    -------
    ndarray, shape (N,)
        Time [s], as recorded.
    float
        Sampling period [s].

    Raises
    ------
    RecordingError
        If there are fewer than two rows, or time is missing, not strictly increasing, or not uniform.
    """
    if table.n_rows < 2:
        raise RecordingError(table.path, f"expected two rows or more, came {table.n_rows}. Record longer.")
    if signal.sample_time_s is not None:
        return np.arange(table.n_rows, dtype=np.float64) * signal.sample_time_s, signal.sample_time_s
    column = str(signal.column)
    time = table.numeric([column])[column]
    time *= signal.scale
    _require_uniform(table, column, time)
    return time, uniform_period_s(time)


def _require_uniform(table: Table, column: str, time: FloatArray) -> None:
    steps = np.diff(time)
    _refuse(table, column, time, 1, ~(steps > 0), "expected a time greater than in the row before")
    period = float(np.median(steps))
    cure = "a missing sample is a row with nan, not a row left out"
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
            f"{table.place(row)}, column {column}: {expected}, came {time[row]:.9g} s "
            f"after {time[row - span]:.9g} s in {before}",
        )
