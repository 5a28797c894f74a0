"""What steps read of a recording: columns as they were recorded, the record the estimator takes, courses to draw."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from estimator.signals.record import FloatArray, Record
from hil.recording import read_record, read_table
from hil.recording.columns import FLAGS, SPEED, TIME, TORQUE_M1, TORQUE_M2
from hil.report.decimate import extremes

REFERENCE = {"m1": "torque_ref_m1_nm", "m2": "torque_ref_m2_nm"}
READING = {"m1": TORQUE_M1, "m2": TORQUE_M2}

DRAWN = 400
"""Stretches of a course that is kept for the report: two samples each."""

DIGITS = 6
"""Significant digits of what is kept to be drawn."""


def columns_of(path: Path) -> Mapping[str, FloatArray]:
    """Return the numeric columns of a recording, each of shape (N,)."""
    names = [TIME, SPEED, FLAGS, *READING.values(), *REFERENCE.values()]
    return read_table(path).numeric(names)


def record_of(path: Path) -> Record:
    return read_record(path)


def thinned(x: FloatArray, *ys: FloatArray) -> list[list[float]]:
    """Return courses thinned for drawing, x first; the peaks of the last one are kept."""
    kept = extremes(ys[-1], DRAWN)
    return [rounded(values[kept]) for values in (x, *ys)]


def rounded(values: FloatArray) -> list[float]:
    """Return numbers with the digits a picture needs."""
    return [float(f"{value:.{DIGITS}g}") for value in np.asarray(values, dtype=np.float64).tolist()]


def json_safe(evidence: Any) -> Any:
    """Return evidence with what JSON has not, NaN and infinity, as None."""
    if isinstance(evidence, Mapping):
        return {str(key): json_safe(value) for key, value in evidence.items()}
    if isinstance(evidence, list | tuple):
        return [json_safe(value) for value in evidence]
    if isinstance(evidence, np.floating | float):
        return float(evidence) if np.isfinite(evidence) else None
    return int(evidence) if isinstance(evidence, np.integer) else evidence
