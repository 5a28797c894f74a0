"""Small pieces that several laws share, compiled."""

from __future__ import annotations

import math

from estimator.compiled import compiled


@compiled
def smooth_sign(speed: float, width: float) -> float:
    """Return the sign of a speed, rounded within ``width`` [same unit] so that a sticking mass can be integrated."""
    return math.tanh(speed / width)


@compiled
def beyond_gap(twist: float, gap: float) -> float:
    """Return the part of a twist that loads the shaft: zero inside a gap of total width ``gap`` [rad]."""
    half = 0.5 * gap
    if twist > half:
        return twist - half
    if twist < -half:
        return twist + half
    return 0.0
