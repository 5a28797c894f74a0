"""What keeps a simulated drive from its torque: field weakening and heat. Counts are per mille of rated torque.

::

    field weakening   limit = maximum · ω_base / |ω|        above the base speed ω_base: constant power
    heat              dx/dt = ((T / T_continuous)² - x) / τ
                      limit falls from maximum to T_continuous while x goes from 0.9 to 1

x is the temperature above that of the surroundings, 1 where the continuous torque would hold it (I²t). Above the
base speed a part of the current weakens the field, so that current per torque rises as ω / ω_base.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

_WARM = 0.9
"""Where derating begins."""


@dataclass(frozen=True, slots=True)
class DriveLimits:
    """Limits a drive sets itself, besides max torque 0x6072; by default none that acts.

    Attributes
    ----------
    base_speed_rad_s
        Field weakening begins here [rad/s].
    continuous_permille
        Torque it can give for ever [per mille of rated].
    thermal_time_constant_s
        Of winding and heat sink together [s].
    torque_step_permille
        Coarseness of torque and current actual value [per mille].
    """

    base_speed_rad_s: float = math.inf
    continuous_permille: float = math.inf
    thermal_time_constant_s: float = 30.0
    torque_step_permille: int = 1

    def weakening(self, speed_rad_s: float) -> float:
        """Field left at a speed, 0 to 1: torque per current, and largest torque, relative to standstill."""
        return min(1.0, self.base_speed_rad_s / max(abs(speed_rad_s), 1e-9))

    def quantised(self, permille: float) -> int:
        """Round a reading to the steps this drive tells it in."""
        return self.torque_step_permille * round(permille / self.torque_step_permille)


class Heat:
    """The temperature of one drive, from cold.

    Parameters
    ----------
    limits
        Continuous torque and time constant.
    """

    __slots__ = ("_limits", "_x")

    def __init__(self, limits: DriveLimits) -> None:
        self._limits = limits
        self._x = 0.0

    @property
    def derating(self) -> bool:
        """Whether it is so warm that the torque is limited."""
        return self._x > _WARM

    def limit_permille(self, maximum_permille: float) -> float:
        """Largest torque at this temperature [per mille of rated]."""
        lowest = min(self._limits.continuous_permille, maximum_permille)
        part = min(max((1.0 - self._x) / (1.0 - _WARM), 0.0), 1.0)
        return lowest + part * (maximum_permille - lowest)

    def pass_time(self, torque_permille: float, duration_s: float) -> None:
        """Let a torque act for a time; exact for a torque that is constant meanwhile."""
        goal = (torque_permille / self._limits.continuous_permille) ** 2
        self._x = goal + (self._x - goal) * math.exp(-duration_s / self._limits.thermal_time_constant_s)
