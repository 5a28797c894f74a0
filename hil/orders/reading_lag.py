"""By how many samples a torque reading follows what was commanded."""

from __future__ import annotations

import numpy as np

from estimator.signals.record import FloatArray

LONGEST_LAG = 5


def reading_lag(reading: FloatArray, reference: FloatArray) -> int:
    """Return by how many samples a reading follows its reference: where their covariance is largest in size."""
    n = reading.shape[0] - LONGEST_LAG
    centred = reference[:n] - np.mean(reference[:n])
    return int(np.argmax([abs(float(centred @ reading[lag : lag + n])) for lag in range(LONGEST_LAG + 1)]))
