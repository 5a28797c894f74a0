"""Small pieces that several laws share, compiled."""

from __future__ import annotations

import math

from estimator.compiled import compiled

BEYOND = 20.0
"""From here on the hyperbolic tangent is 1 to the last bit; most speeds are beyond, and need no tangent."""


@compiled
def smooth_sign(speed: float, width: float) -> float:
    """Return the sign of a speed, rounded within ``width`` [same unit] so that a sticking mass can be integrated."""
    ratio = speed / width
    if abs(ratio) > BEYOND:
        return math.copysign(1.0, ratio)
    return math.tanh(ratio)


@compiled
def dry_friction(speed: float, friction: float, width: float) -> float:
    """Return the torque ``T_c sign(w)`` against a speed [rad/s], rounded within ``width``."""
    if friction == 0.0:
        return 0.0
    return friction * smooth_sign(speed, width)


@compiled
def beyond_gap(twist: float, gap: float) -> float:
    """Return the part of a twist that loads the shaft: zero inside a gap of total width ``gap`` [rad]."""
    half = 0.5 * gap
    if twist > half:
        return twist - half
    if twist < -half:
        return twist + half
    return 0.0


@compiled
def share_inside(start: float, length: float, low: float, high: float) -> float:
    """Return which share of ``[start, start + length]`` lies in ``[low, high]``: smooth in both, as a fit needs."""
    inside = min(start + length, high) - max(start, low)
    return inside / length if inside > 0.0 else 0.0


@compiled
def inertia_while(inertia: float, extra: float, share: float) -> float:
    """Return the inertia that answers to a torque as one with ``extra`` on it for a ``share`` of the time does.

    Accelerations add up over time, not inertias: it is the harmonic mean. Without a share it is ``inertia``, exactly.
    """
    if share == 0.0:
        return inertia
    whole = inertia + extra
    return inertia * (whole / (whole - share * extra))


@compiled
def overtoned_wave(amplitude: float, angle: float, phase: float, in_step: float, across: float) -> float:
    """Return ``A (cos(x) + a cos(2 x) + b sin(2 x))``, ``x = angle + phase``; 0 without an amplitude, at no cost."""
    if amplitude == 0.0:
        return 0.0
    cosine, sine = math.cos(angle + phase), math.sin(angle + phase)
    return amplitude * (cosine + in_step * (2.0 * cosine * cosine - 1.0) + across * 2.0 * sine * cosine)


@compiled
def wave(amplitude: float, angle: float, phase: float) -> float:
    """Return ``A cos(angle + phase)``; 0 without an amplitude, at no cost."""
    if amplitude == 0.0:
        return 0.0
    return amplitude * math.cos(angle + phase)
