"""A curve through knots, compiled: of one simulation, or of many in lanes.

Between knots it is the piecewise cubic of Fritsch and Butland (SIAM J. Sci. Stat. Comput. 5, 1984): its slope at a knot
is a harmonic mean of those of the secants on both sides, 0 where these differ in sign. So it is monotone wherever its
values are, and runs over no value that is not given. At both ends it has the slope of the last secant and goes straight
on. One that ``wraps`` repeats itself: its last value is its first.

A curve stands in the parameter vector as a count, behind it `MOST_KNOTS` knots, those beyond the count infinite, and as
many values.
"""

from __future__ import annotations

import math

import numpy as np

from estimator.compiled import compiled
from estimator.lanes import broadcast_as, choose, every
from estimator.signals.record import FloatArray

MOST_KNOTS = 16

KNOTS, VALUES = 1, 1 + MOST_KNOTS
"""Where knots and values begin, behind the place of the count."""

INFINITE = math.inf

WHOLE = 1.5 * 2.0**52  # a number that is added and taken away again rounds to whole ones, in lanes, too


@compiled
def secant(p: FloatArray, at: int, i: int) -> float:
    """Return the slope of the straight line from knot i to the next."""
    rise = p[at + VALUES + i + 1] - p[at + VALUES + i]
    return rise / (p[at + KNOTS + i + 1] - p[at + KNOTS + i])


@compiled
def slope_at_knot(p: FloatArray, at: int, i: int, last: int, wraps: bool) -> float:
    """Return the slope at knot i of those from 0 to ``last``."""
    left = i - 1 if i > 0 else last - 1
    right = i if i < last else 0
    if not wraps and (i == 0 or i == last):
        left = right if i == 0 else left
        right = left
    before, after = secant(p, at, left), secant(p, at, right)
    wide_before = p[at + KNOTS + left + 1] - p[at + KNOTS + left]
    wide_after = p[at + KNOTS + right + 1] - p[at + KNOTS + right]
    product = before * after
    weighed = (2.0 * wide_after + wide_before) * after + (wide_after + 2.0 * wide_before) * before
    alike = product > 0.0
    return choose(alike, 3.0 * (wide_before + wide_after) * product / choose(alike, weighed, 1.0), 0.0)


@compiled
def curve(x: float, p: FloatArray, at: int, wraps: bool) -> tuple[float, float]:
    """Return value and slope at ``x`` of the curve whose count stands at ``at``, which is not 0."""
    last = 0
    while last < MOST_KNOTS - 1 and every(p[at + KNOTS + last + 1] < INFINITE):
        last += 1
    value = broadcast_as(p[at + VALUES], x)
    slope = slope_at_knot(p, at, 0, last, wraps)
    value += slope * min(x - p[at + KNOTS], 0.0)
    i = 0
    while i < last and not every(x <= p[at + KNOTS + i]):
        low, high = p[at + KNOTS + i], p[at + KNOTS + i + 1]
        if i < last - 1 and every(x >= high):
            value += p[at + VALUES + i + 1] - p[at + VALUES + i]
            i += 1
            continue
        wide, straight = high - low, secant(p, at, i)
        first, second = slope_at_knot(p, at, i, last, wraps), slope_at_knot(p, at, i + 1, last, wraps)
        square, cube = 3.0 * straight - 2.0 * first - second, first + second - 2.0 * straight
        t = min(max(x - low, 0.0), wide) / wide
        value += wide * t * (first + t * (square + t * cube))
        slope = choose(x > low, first + t * (2.0 * square + 3.0 * t * cube), slope)
        if i == last - 1:
            value += second * max(x - high, 0.0)
        i += 1
    return value, slope


def span(p: FloatArray, at: int) -> tuple[float, float]:
    """Return the first and the last knot of a curve."""
    knots = p[at + KNOTS : at + KNOTS + round(float(p[at]))]
    return float(knots[0]), float(knots[-1])


@compiled
def wrapped(angle: float, p: FloatArray, at: int) -> float:
    """Return an angle within the one period that a curve has knots for."""
    last = 0
    while last < MOST_KNOTS - 1 and every(p[at + KNOTS + last + 1] < INFINITE):
        last += 1
    first, end = p[at + KNOTS], p[at + KNOTS + last]
    turns = (angle - 0.5 * (first + end)) / (end - first)
    return angle - (end - first) * ((turns + WHOLE) - WHOLE)


@compiled
def curve_over(x: FloatArray, p: FloatArray, at: int) -> FloatArray:
    """Return the values at each ``x``, shape (N,)."""
    out = np.empty_like(x)
    for i in range(x.size):
        out[i] = curve(x[i], p, at, False)[0]
    return out


@compiled
def steepest(p: FloatArray, at: int) -> float:
    """Return the largest size of a curve's secants; 0 of one that is not there."""
    found, i = 0.0, 0
    while p[at] > 0.0 and i < MOST_KNOTS - 1 and p[at + KNOTS + i + 1] < INFINITE:
        found = max(found, abs(secant(p, at, i)))
        i += 1
    return found
