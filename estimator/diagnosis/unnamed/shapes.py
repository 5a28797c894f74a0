"""Functions of signals and of their course in time that laws are made of; arrays of shape (B,)."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from estimator.diagnosis.line import Motion
from estimator.signals.record import FloatArray
from estimator.signals.slider import carried

ROUNDED = 0.02
"""A sign function changes over this share of its argument's range."""

KNOTS = 9
"""Of a free function of one signal: between its first and 99th percentile, the same share of samples between two."""


def top_of(values: FloatArray) -> float:
    """Return the top of a signal's size, but for single values."""
    return max(float(np.percentile(np.abs(values), 99)), np.finfo(float).tiny)


def sign(values: FloatArray) -> FloatArray:
    """Return a signal's sign, rounded about zero."""
    width = ROUNDED * top_of(values)
    rounded: FloatArray = np.tanh(values / width)
    return rounded


def inside(values: FloatArray, share: float) -> FloatArray:
    """Return a signal held at a share of its range."""
    limit = share * top_of(values)
    held: FloatArray = np.clip(values, -limit, limit)
    return held


def beyond(values: FloatArray, share: float) -> FloatArray:
    """Return what a signal is beyond a share of its range."""
    excess: FloatArray = values - inside(values, share)
    return excess


def slide(values: FloatArray, share: float) -> FloatArray:
    """Return what a slider carries that yields after a share of a signal's range (Prandtl)."""
    load: FloatArray = carried(values, share * top_of(values))
    return load


def peaked(speed: FloatArray, share: float) -> FloatArray:
    """Return a drag that is greatest at a share of the top speed, as of eddy currents."""
    there = speed / (share * top_of(speed))
    drag: FloatArray = there / (1.0 + there**2)
    return drag


def fading(speed: FloatArray, share: float) -> FloatArray:
    """Return a friction that fades away over a share of the top speed (Stribeck)."""
    friction: FloatArray = sign(speed) * np.exp(-np.abs(speed) / (share * top_of(speed)))
    return friction


def behind(values: FloatArray, motion: Motion, time_constant_s: float) -> FloatArray:
    """Return how far a first-order lag of a signal is behind it."""
    period_s = float(motion.time_s[1] - motion.time_s[0])
    keep = np.exp(-period_s / time_constant_s)
    lagged = lfilter([1.0 - keep], [1.0, -keep], values - values[0]) + values[0]
    late: FloatArray = lagged - values
    return late


def rate(values: FloatArray, motion: Motion) -> FloatArray:
    """Return a signal's change per second."""
    slope: FloatArray = np.gradient(values, motion.time_s)
    return slope


def since_start(motion: Motion) -> FloatArray:
    """Return the time since the first block [s]."""
    since: FloatArray = motion.time_s - motion.time_s[0]
    return since


def decaying(values: FloatArray, motion: Motion, time_s: float) -> FloatArray:
    """Return a signal whose part decays over a time, as oil warms up."""
    part: FloatArray = values * np.exp(-since_start(motion) / time_s)
    return part


def rising(values: FloatArray, motion: Motion, time_s: float) -> FloatArray:
    """Return a signal whose part sets in over a time."""
    return values - decaying(values, motion, time_s)


def at_low_speed(values: FloatArray, motion: Motion, share: float) -> FloatArray:
    """Return a signal that fades with the speed, over a share of its top."""
    faded: FloatArray = values / (1.0 + (motion.speed / (share * top_of(motion.speed))) ** 2)
    return faded


def knots_of(values: FloatArray) -> FloatArray:
    """Return the knots of a free function of a signal, increasing."""
    return np.unique(np.percentile(values, np.linspace(1.0, 99.0, KNOTS)))


def hats(values: FloatArray, knots: FloatArray) -> FloatArray:
    """Return the piecewise linear basis on K knots, shape (N, K); constant beyond the ends."""
    return np.stack([np.interp(values, knots, unit) for unit in np.eye(knots.size)], axis=1)
