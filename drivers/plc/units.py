"""Units a register map may use, and what one of them is in the unit the driver works in.

The driver works in SI: rad/s, Nm, rad, rad/s^2, and 1 for counts, states and bits. A map says in ``unit`` what its
values are in after ``scale``; what is not in this table is refused when the map is taken over, and nothing is guessed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

RAD_PER_TURN: Final = 2.0 * math.pi
SECONDS_PER_MINUTE: Final = 60.0

IN_SI: Final[Mapping[str, Mapping[str, float]]] = MappingProxyType(
    {
        "rad/s": {
            "rad/s": 1.0,
            "1/min": RAD_PER_TURN / SECONDS_PER_MINUTE,
            "rpm": RAD_PER_TURN / SECONDS_PER_MINUTE,
            "1/s": RAD_PER_TURN,
        },
        "Nm": {"Nm": 1.0, "kNm": 1000.0},
        "rad": {"rad": 1.0, "deg": RAD_PER_TURN / 360.0},
        "rad/s^2": {"rad/s^2": 1.0},
        "1": {"1": 1.0},
    }
)
"""By the driver's unit: each unit a map may use for it, and one of it in the driver's. ``1/min`` counts turns."""
