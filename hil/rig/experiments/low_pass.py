"""A first-order low-pass, one value per cycle: ``y' = (u - y) / time_constant``, exact for held input."""

from __future__ import annotations

import math


class LowPass:
    """Low-pass one signal; it starts at the first value it is given.

    Parameters
    ----------
    time_constant_s
        Time constant [s].
    period_s
        Time between two values [s].
    """

    __slots__ = ("_share", "value")

    def __init__(self, time_constant_s: float, period_s: float) -> None:
        self._share = 1.0 - math.exp(-period_s / time_constant_s)
        self.value = math.nan

    def update(self, value: float) -> float:
        """Take the value of this cycle and return the low-passed one."""
        self.value = value if math.isnan(self.value) else self.value + self._share * (value - self.value)
        return self.value
