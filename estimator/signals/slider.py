"""What a slider carries that a signal moves: a spring in a row with dry friction (Prandtl 1928)."""

from __future__ import annotations

import numpy as np

from estimator.compiled import compiled
from estimator.signals.record import FloatArray


@compiled
def carried(values: FloatArray, width: float) -> FloatArray:
    """Return the deflection of a slider that is moved by a signal, from rest, and yields at a width."""
    found = np.zeros(values.size)
    for k in range(1, values.size):
        found[k] = min(max(found[k - 1] + values[k] - values[k - 1], -width), width)
    return found
