"""The load torque along a road, a thousand times a second: surface, hills and gusts.

ISO 8608 describes a surface by its displacement spectrum ``G_d(n) = G_d(n_0) (n / n_0)^-2``, one-sided, n in cycles
per metre, n_0 = 0.1. Its slope then has the constant spectrum ``(2 pi n_0)^2 G_d(n_0)``. A tyre climbs the slope below
it: its load times the slope acts against the motion. It does so averaged over the patch that touches the ground; the
rear axle meets what the front one met before. At 8 m/s the patch ends the spectrum near 8 Hz.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.signal import lfilter

from tests.benchmarks.buses.bus import METRES_PER_RAD, Bus
from tests.benchmarks.buses.line import Array

GRAVITY_M_S2 = 9.80665
REFERENCE_PER_M = 0.1
PATCH_M = 0.15
"""Distance after which a tyre has forgotten a step of the slope [m]."""

WHEELBASE_M, FRONT_SHARE = 6.0, 0.36
"""Of a solo bus of 12 m."""

HILLS_M = (70.0, 110.0, 180.0, 290.0)
"""Mean lengths of the rises and falls; each is drawn within a fifth of it."""

GUST_S = 3.0


def load_torque(bus: Bus, n: int, step_s: float, rng: np.random.Generator) -> Array:
    """Return what varies of the load torque at the motor shaft, shape (n,), every ``step_s`` [Nm]."""
    return surface(bus, n, step_s, rng) + hills(bus, n, step_s, rng) + gusts(bus, n, step_s, rng)


def surface(bus: Bus, n: int, step_s: float, rng: np.random.Generator) -> Array:
    """Return the torque that the rough surface takes, shape (n,) [Nm]."""
    step_m = bus.speed_m_s * step_s
    behind = round(WHEELBASE_M / step_m)
    slope_density_m = (2.0 * math.pi * REFERENCE_PER_M) ** 2 * bus.road.roughness_m3
    slope = rng.normal(0.0, math.sqrt(slope_density_m / (2.0 * step_m)), n + behind)
    both = FRONT_SHARE * slope[behind:] + (1.0 - FRONT_SHARE) * slope[:n]
    kept = math.exp(-step_m / PATCH_M)
    weight_nm = bus.mass_kg * GRAVITY_M_S2 * METRES_PER_RAD
    return np.asarray(weight_nm * lfilter([1.0 - kept], [1.0, -kept], both), dtype=np.float64)


def hills(bus: Bus, n: int, step_s: float, rng: np.random.Generator) -> Array:
    """Return the torque that the grade takes: sines that share the power in a drawn proportion, shape (n,) [Nm]."""
    way_m = bus.speed_m_s * step_s * np.arange(n)
    shares = np.sqrt(rng.dirichlet(np.ones(len(HILLS_M))))
    lengths_m = np.array(HILLS_M) * rng.uniform(0.8, 1.2, len(HILLS_M))
    phases = rng.uniform(0.0, 2.0 * math.pi, len(HILLS_M))
    waves = np.sin(2.0 * math.pi * way_m[:, np.newaxis] / lengths_m + phases)
    return np.asarray(math.sqrt(2.0) * bus.road.grade_nm * waves @ shares, dtype=np.float64)


def gusts(bus: Bus, n: int, step_s: float, rng: np.random.Generator) -> Array:
    """Return the torque that gusts take: a first-order Markov process, shape (n,) [Nm]."""
    kept = math.exp(-step_s / GUST_S)
    pushes = rng.normal(0.0, bus.road.gust_nm * math.sqrt(1.0 - kept**2), n)
    pushes[0] /= math.sqrt(1.0 - kept**2)  # as strong from the beginning on
    return np.asarray(lfilter([1.0], [1.0, -kept], pushes), dtype=np.float64)
