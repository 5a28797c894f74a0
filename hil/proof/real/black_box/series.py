"""Recordings as a black box reads them: stretches, at a lower rate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.diagnosis.segments import tiles
from estimator.signals.record import BoolArray, FloatArray, IntArray, OutputKind, Record


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """An unbroken part of a recording.

    Attributes
    ----------
    rows : ndarray of int, shape (n,)
        Rows of the recording at which the output is taken.
    inputs : ndarray, shape (n, M)
        Total torque, its mean from one row to the next; or, on a bench, the imposed motion and its rate at the rows.
    output : ndarray, shape (n,)
        Measured output at the rows; a straight line across what is not good.
    good, used : ndarray of bool, shape (n,)
        Where the output was measured; where the black box may see it.
    sample_time_s : float
        Time between rows [s].
    kind : OutputKind
        What the output is.
    """

    rows: IntArray
    inputs: FloatArray
    output: FloatArray
    good: BoolArray
    used: BoolArray
    sample_time_s: float
    kind: OutputKind

    @property
    def main_input(self) -> FloatArray:
        """The torque, or the imposed motion; shape (n,)."""
        return self.inputs[:, 0]


def stretches(record: Record, used: BoolArray, sample_time_s: float, shortest: int) -> list[Stretch]:
    """Cut a recording at its long gaps and take every n-th sample.

    Parameters
    ----------
    used : ndarray of bool, shape (N,)
        Samples that the black box may see.
    sample_time_s
        Time between samples, rounded to a multiple of the recording's [s].
    shortest
        Good samples that a stretch must have.
    """
    factor = max(round(sample_time_s / record.sample_time_s), 1)
    index = np.arange(record.okay.size, dtype=np.int64)
    first, found = 0, []
    for part in tiles(record):
        rows = index[first : first + part.okay.size]
        first += part.okay.size
        count = rows.size // factor
        rows = rows[: count * factor]
        at = rows[::factor]
        good = record.okay[at]
        if int((good & used[at]).sum()) < shortest:
            continue
        output = np.interp(at, at[good], record.output[at[good]])
        inputs = _inputs(record, rows, at, factor)
        found.append(Stretch(at, inputs, output, good, good & used[at], factor * record.sample_time_s, record.kind))
    return found


def _inputs(record: Record, rows: IntArray, at: IntArray, factor: int) -> FloatArray:
    if record.imposed is None:
        torque: FloatArray = record.total_torque_nm[rows].reshape(-1, factor).mean(axis=1)[:, np.newaxis]
        return torque
    rate = np.gradient(record.imposed, record.sample_time_s)[rows].reshape(-1, factor).mean(axis=1)
    return np.column_stack([record.imposed[at], rate])


def spread(stretches_: Sequence[Stretch], values: Sequence[FloatArray], n_rows: int) -> FloatArray:
    """Return values at the stretches' rows as a course over a recording, NaN elsewhere; shape (n_rows,)."""
    course = np.full(n_rows, np.nan)
    for stretch, value in zip(stretches_, values, strict=True):
        course[stretch.rows] = value
    return course
