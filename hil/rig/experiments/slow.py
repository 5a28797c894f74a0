"""Coast and ramp: what shows where the torque is zero, or changes slowly."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Coast:
    """No torque from a speed on: what slows the vehicle is its own."""

    start_speed_rad_s: float
    duration_s: float  # Of the measured part

    def begin(self, torque_nm: float) -> None:
        """Let go of the torque that held the speed [Nm]."""

    def torque_nm(self, time_s: float, speed_rad_s: float) -> float:
        """Zero [Nm]."""
        return 0.0


@dataclass(slots=True)
class Ramp:
    """Torque that rises and falls evenly about what keeps the vehicle in its place, through zero."""

    swing_nm: float  # Largest torque either way
    ramp_s: float  # Time from the middle to it
    duration_s: float  # Of the measured part
    start_speed_rad_s: float = 0.0
    _hold_nm: float = 0.0

    def begin(self, torque_nm: float) -> None:
        """Swing about the torque that keeps the vehicle in its place [Nm]."""
        self._hold_nm = torque_nm

    def torque_nm(self, time_s: float, speed_rad_s: float) -> float:
        """Torque of the triangle [Nm]: up, down through zero, and back, in four ramps."""
        quarter = (time_s / self.ramp_s) % 4.0
        share = quarter if quarter < 1.0 else 2.0 - quarter if quarter < 3.0 else quarter - 4.0
        return self._hold_nm + self.swing_nm * share
