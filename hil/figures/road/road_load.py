"""The load torque of a road: rolling resistance, slope, air and surface, at the motor shaft.

::

    T_0 = r [ c_r m g + m g s(x) + rho/2 c_d A (v + v_w) |v + v_w| ] + T_r

x distance, v speed, r metres driven per radian of the motor. The slope s is a sum of sines over distance with random
phases; the gusts of the wind v_w are a first-order Markov process; the surface's part T_r is one, too, over distance,
short enough to reach into the band of the resonance. A process of scale L has the spectrum of white noise through a
low-pass and the standard deviation it is given, however fast one drives.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from hil.figures.road.conditions import Conditions

GRAVITY_M_S2: Final = 9.80665
AIR_KG_M3: Final = 1.2
DRAG_AREA_M2: Final = 5.0
"""c_d A of a city bus: 0.6 to 0.7 times 7.5 to 8 m^2 of front."""

ROLLING: Final = 0.008
"""Rolling resistance of bus tyres on asphalt; those on a test drum have 0.006, a rough road 0.01."""

WAVELENGTHS_M: Final = (90.0, 150.0, 260.0, 410.0)
"""Of the road's rises and falls; no two in a whole ratio."""

GUST_S: Final = 3.0
"""Time over which a gust lasts [s]."""

ROUGHNESS_M: Final = 0.3
"""Distance over which the surface changes [m]: at 8 m/s its corner is at v / 2 pi L = 4 Hz."""


@dataclass(frozen=True, slots=True)
class Bus:
    """What of the bus the load torque depends on: its mass [kg] and metres driven per radian of the motor."""

    mass_kg: float
    metres_per_rad: float


class RoadLoad:
    """The load torque along one drive, asked for once per period.

    Parameters
    ----------
    bus
        Loaded as it is.
    conditions
        Of the drive.
    """

    __slots__ = ("_bus", "_conditions", "_gust_m_s", "_phases", "_rng", "_surface_nm")

    def __init__(self, bus: Bus, conditions: Conditions) -> None:
        self._bus = bus
        self._conditions = conditions
        self._rng = np.random.default_rng(conditions.seed)
        self._phases = self._rng.uniform(0.0, 2.0 * np.pi, len(WAVELENGTHS_M))
        self._gust_m_s = 0.0
        self._surface_nm = 0.0

    def torque_nm(self, speed_rad_s: float, distance_m: float, period_s: float) -> float:
        """Return the load torque of the next period [Nm]."""
        v = speed_rad_s * self._bus.metres_per_rad
        given = self._conditions
        self._gust_m_s = self._next(self._gust_m_s, given.gust_m_s, period_s / GUST_S)
        self._surface_nm = self._next(self._surface_nm, given.roughness_nm, abs(v) * period_s / ROUGHNESS_M)
        weight_n = self._bus.mass_kg * GRAVITY_M_S2
        air_m_s = v + given.wind_m_s + self._gust_m_s
        force_n = weight_n * (math.copysign(ROLLING, v) * (v != 0.0) + self._slope(distance_m))
        force_n += 0.5 * AIR_KG_M3 * DRAG_AREA_M2 * air_m_s * abs(air_m_s)
        return force_n * self._bus.metres_per_rad + self._surface_nm

    def _slope(self, distance_m: float) -> float:
        amplitude = self._conditions.slope_rms * math.sqrt(2.0 / len(WAVELENGTHS_M))
        waves = zip(WAVELENGTHS_M, self._phases, strict=True)
        return amplitude * sum(math.sin(2.0 * math.pi * distance_m / length + phase) for length, phase in waves)

    def _next(self, value: float, spread: float, steps: float) -> float:
        """Return the next value of a first-order Markov process, ``steps`` of its scale on."""
        kept = math.exp(-steps)
        return kept * value + spread * math.sqrt(1.0 - kept * kept) * float(self._rng.standard_normal())
