"""The DC link of a simulated drive: steady while it is supplied, and then gone within a few cycles."""

from __future__ import annotations

import math
from typing import Final

SUPPLY_V: Final = 650.0
"""A bus's traction battery."""

UNDER_VOLTAGE_V: Final = 0.7 * SUPPLY_V
"""Below it the drive goes into fault."""

DISCHARGE_S: Final = 0.02
"""Time constant with which a drive under load empties its capacitors [s]."""


class DcLink:
    """Voltage over simulated time."""

    __slots__ = ("_voltage_v", "supplied")

    def __init__(self) -> None:
        self._voltage_v = SUPPLY_V
        self.supplied = True

    @property
    def millivolts(self) -> int:
        """DC link circuit voltage, 0x6079 [mV]."""
        return round(1000.0 * self._voltage_v)

    @property
    def too_low(self) -> bool:
        """Whether the drive can't work with it."""
        return self._voltage_v < UNDER_VOLTAGE_V

    def pass_time(self, duration_s: float) -> None:
        """Let time pass; a supply that is back is back at once."""
        self._voltage_v = SUPPLY_V if self.supplied else self._voltage_v * math.exp(-duration_s / DISCHARGE_S)
