"""What is known beforehand of the vehicle that the drives move: inertia from empty to full, and the road."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

GRAVITY_M_S2: Final = 9.81
ROLLING_RAD_S2: Final = 1.0
"""What rolling and dry friction may hold back or let go where the speed changes sign: 0.9 % of the weight of a bus."""


@dataclass(frozen=True, slots=True)
class Vehicle:
    """What is known of it beforehand, at the motor shaft."""

    inertia_kg_m2: float  # usual total
    empty_kg_m2: float  # least total
    full_kg_m2: float  # greatest total
    most_grade: float  # steepest road, rise over way
    travel_m_per_rad: float  # way per angle of the shaft

    @property
    def most_load_rad_s2(self) -> float:
        """Greatest load as the deceleration of a free vehicle [rad/s²]: the steepest road, and rolling."""
        return GRAVITY_M_S2 * self.most_grade / self.travel_m_per_rad + ROLLING_RAD_S2

    @property
    def gains(self) -> tuple[float, float]:
        """Least and greatest acceleration over what the usual inertia has."""
        return self.inertia_kg_m2 / self.full_kg_m2, self.inertia_kg_m2 / self.empty_kg_m2
