"""How far the torque that stands in for one that was not read may be from it."""

from __future__ import annotations

import numpy as np

from estimator.signals.once import once
from estimator.signals.record import BoolArray, FloatArray, Record


@once
def stand_in_variance(record: Record) -> FloatArray:
    """Return the variance of the sum of all torques where one was not read, shape (N,) [Nm²]; 0 where all were.

    A straight line was drawn over each gap, or the torque of its one end held. How far such a line is from the torque
    in the middle of a gap as long is seen in the rest of the recording.
    """
    variance = np.zeros(record.time_s.size)
    if record.torque_okay is None:
        return variance
    for torque, trusted in zip(record.torque_nm.T, record.torque_trusted.T, strict=True):
        length = _gap_lengths(trusted)
        for gap in np.unique(length[length > 0]):
            variance[length == gap] += _line_error(torque, int(gap))
    return variance


def _gap_lengths(trusted: BoolArray) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Return how long the gap is that each row belongs to, shape (N,) [samples]; 0 outside of one."""
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], ~trusted, [False]]).astype(np.int8)))
    length = np.zeros(trusted.size, dtype=np.intp)
    for first, end in bounds.reshape(-1, 2):
        length[first:end] = end - first
    return length


def _line_error(torque: FloatArray, gap: int) -> float:
    """Return the mean squared error of a straight line in the middle of a gap of so many rows [Nm²]."""
    whole = min(gap + 1, torque.size - 1)
    half = (whole + 1) // 2
    ends, middle = (torque[:-whole], torque[whole:]), torque[half : torque.size - whole + half]
    line = ends[0] + half / whole * (ends[1] - ends[0])
    return float(np.mean((middle - line) ** 2))
