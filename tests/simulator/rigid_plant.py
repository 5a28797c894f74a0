"""A plant for rigs whose driveline does not matter."""

import math


class RigidPlant:
    """One inertia with viscous drag: ``J dw/dt = T1 + T2 - b w``; the shaft is rigid.

    Stepped by the exact solution for held torque, so the result does not depend on the period.
    """

    def __init__(self, inertia_kg_m2: float, drag_nm_s: float, speed_rad_s: float = 0.0) -> None:
        self._time_constant_s = inertia_kg_m2 / drag_nm_s
        self._drag_nm_s = drag_nm_s
        self._speed_rad_s = speed_rad_s

    @property
    def speed_rad_s(self) -> float:
        """True motor speed now [rad/s]."""
        return self._speed_rad_s

    def advance(self, torque_nm: tuple[float, float], duration_s: float) -> None:
        """Let the plant run with both inverters' torques held [Nm] for ``duration_s`` [s]."""
        final_rad_s = sum(torque_nm) / self._drag_nm_s
        decay = math.exp(-duration_s / self._time_constant_s)
        self._speed_rad_s = final_rad_s + (self._speed_rad_s - final_rad_s) * decay
