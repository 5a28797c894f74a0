"""What simulated inverters drive: the plant as they see it, and a rigid one."""

from __future__ import annotations

import math
from typing import Protocol, runtime_checkable

from estimator.signals.record import Location, OutputKind


class Plant(Protocol):
    """A driveline as the simulated rig sees it; all values reflected to the motor shaft."""

    @property
    def speed_rad_s(self) -> float:
        """True motor speed now [rad/s]."""

    def advance(self, torque_nm: tuple[float, float], duration_s: float) -> None:
        """Let the plant run with both inverters' torques held [Nm] for ``duration_s`` [s]."""


@runtime_checkable
class SensedPlant(Plant, Protocol):
    """A driveline with further places to measure at."""

    def measured(self, kind: OutputKind, at: Location) -> float:
        """Return what a sensor there shows now [rad/s, rad, Nm, rad/s^2]."""


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
