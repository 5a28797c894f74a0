"""Small pieces that several laws share, compiled: of one simulation, or of many in lanes."""

from __future__ import annotations

import math

from estimator.compiled import compiled
from estimator.lanes import choose, every

BEYOND = 20.0
"""From here on the hyperbolic tangent is 1 to the last bit; most speeds are beyond, and need no tangent."""

NOTHING_LEFT = 40.0  # from here on the exponential of the negative is lost next to 1
LEAST = 1e-300  # a size that is next to nothing and has a logarithm
BENT = 0.625  # up to here the hyperbolic tangent is a rational function of its argument to the last bit


@compiled
def hyperbolic_tangent(x: float) -> float:
    """Return the hyperbolic tangent to the last two bits; the C library's takes longer, four times in every step.

    Moshier, Methods and Programs for Mathematical Functions, 1989 (Cephes' ``tanh``).
    """
    size = abs(x)
    if every(size > BEYOND):
        return math.copysign(1.0, x)
    z = x * x
    above = (-9.64399179425052238628e-1 * z - 9.92877231001918586564e1) * z - 1.61468768441708447952e3
    below = ((z + 1.12811678491632931402e2) * z + 2.23548839060100448583e3) * z + 4.84406305325125486048e3
    straight = x + x * z * above / below
    if every(size <= BENT):
        return straight
    return choose(size > BENT, math.copysign(1.0 - 2.0 / (math.exp(2.0 * min(size, BEYOND)) + 1.0), x), straight)


@compiled
def power(size: float, exponent: float) -> float:
    """Return ``size ** exponent`` of what is not negative, to 13 digits; the C library's takes longer for the rest."""
    return choose(size > 0.0, math.exp(exponent * math.log(max(size, LEAST))), 0.0)


@compiled
def fading(x: float) -> float:
    """Return ``exp(-x)`` of what is not negative; 0 where nothing is left of it, at no cost."""
    if every(x >= NOTHING_LEFT):
        return 0.0
    return choose(x < NOTHING_LEFT, math.exp(-x), 0.0)


@compiled
def smooth_sign(speed: float, width: float) -> float:
    """Return the sign of a speed, rounded within ``width`` [same unit] so that a sticking mass can be integrated."""
    return hyperbolic_tangent(speed / width)


@compiled
def dry_friction(speed: float, friction: float, width: float) -> float:
    """Return the torque ``T_c sign(w)`` against a speed [rad/s], rounded within ``width``."""
    if every(friction == 0.0):
        return 0.0
    return friction * smooth_sign(speed, width)


@compiled
def beyond_gap(twist: float, gap: float) -> float:
    """Return the part of a twist that loads the shaft: zero inside a gap of total width ``gap`` [rad]."""
    half = 0.5 * gap
    return choose(twist > half, twist - half, choose(twist < -half, twist + half, 0.0))


@compiled
def share_inside(start: float, length: float, low: float, high: float) -> float:
    """Return which share of ``[start, start + length]`` lies in ``[low, high]``: smooth in both, as a fit needs."""
    inside = min(start + length, high) - max(start, low)
    return choose(inside > 0.0, inside / length, 0.0)


@compiled
def inertia_while(inertia: float, extra: float, share: float) -> float:
    """Return the inertia that answers to a torque as one with ``extra`` on it for a ``share`` of the time does."""
    if every(share == 0.0):
        return inertia
    whole = inertia + extra
    return choose(share == 0.0, inertia, inertia * (whole / (whole - share * extra)))


@compiled
def overtoned_wave(amplitude: float, angle: float, phase: float, in_step: float, across: float) -> float:
    """Return ``A (cos(x) + a cos(2 x) + b sin(2 x))``, ``x = angle + phase``; 0 without an amplitude, at no cost."""
    if every(amplitude == 0.0):
        return 0.0
    cosine, sine = math.cos(angle + phase), math.sin(angle + phase)
    return amplitude * (cosine + in_step * (2.0 * cosine * cosine - 1.0) + across * 2.0 * sine * cosine)


@compiled
def wave(amplitude: float, angle: float, phase: float) -> float:
    """Return ``A cos(angle + phase)``; 0 without an amplitude, at no cost."""
    if every(amplitude == 0.0):
        return 0.0
    return amplitude * math.cos(angle + phase)
