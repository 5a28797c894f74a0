"""The withheld accelerometer as judge of a road's grade.

Along the car it reads ``a = dv/dt + g sin(grade)``. So ``a - dv/dt`` is the grade, but for the accelerometer's offset,
which a correlation does not see. What the model was under is a force that holds the same, times the mass.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import butter, filtfilt

from estimator.signals.record import BoolArray, FloatArray


def true_grade(acceleration_m_s2: FloatArray, speed_m_s: FloatArray, sample_time_s: float) -> FloatArray:
    """Return g sin(grade) with the accelerometer's offset [m/s^2]; all of shape (N,)."""
    grade: FloatArray = acceleration_m_s2 - np.gradient(speed_m_s, sample_time_s)
    return grade


def low_passed(course: FloatArray, there: BoolArray, low_pass_hz: float, sample_time_s: float) -> FloatArray:
    """Return a course through a low-pass that counts only where it is there; all of shape (N,).

    First order, forwards and backwards: its weights are positive, so that a mean over what is there is a mean.
    """
    b, a = butter(1, low_pass_hz, fs=1.0 / sample_time_s)
    value = filtfilt(b, a, np.where(there, course, 0.0))
    weight = filtfilt(b, a, there.astype(np.float64))
    passed: FloatArray = value / np.maximum(weight, np.finfo(np.float64).tiny)
    return passed


def correlation(
    load: FloatArray, grade: FloatArray, there: BoolArray, low_pass_hz: float, sample_time_s: float
) -> float | None:
    """Return how the two courses correlate through one low-pass; None where either is constant."""
    there = there & np.isfinite(load) & np.isfinite(grade)
    if not there.any() or min(float(np.ptp(course[there])) for course in (load, grade)) == 0.0:
        return None
    seen = [low_passed(course, there, low_pass_hz, sample_time_s)[there] for course in (load, grade)]
    return float(np.corrcoef(seen[0], seen[1])[0, 1])
