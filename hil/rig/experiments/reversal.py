"""Reversal: back and forth through standstill, what dry friction and backlash show themselves in."""

from __future__ import annotations

from hil.rig.experiments.staged import LowPass

FILTER_S = 0.1
"""Low-pass of the speed that decides on turning [s]: a resonance at 8 Hz is a fifth of itself behind it."""


class Reversal:
    """Constant torque one way until the speed is reached, then the other way.

    Turning at a speed rather than at a time keeps the vehicle near its place on a grade, and makes the
    speed cross zero in every half period whatever the inertia is.
    """

    __slots__ = ("_direction", "_duration_s", "_hold_nm", "_speed", "_swing_nm", "_turning_speed_rad_s")

    def __init__(self, turning_speed_rad_s: float, swing_nm: float, duration_s: float, period_s: float) -> None:
        self._speed = LowPass(FILTER_S, period_s)
        self._turning_speed_rad_s = turning_speed_rad_s
        self._swing_nm = swing_nm
        self._duration_s = duration_s
        self._direction = 1.0
        self._hold_nm = 0.0

    @property
    def start_speed_rad_s(self) -> float:
        """Standstill [rad/s]."""
        return 0.0

    @property
    def duration_s(self) -> float:
        """Length of the measured part [s]."""
        return self._duration_s

    def begin(self, torque_nm: float) -> None:
        """Swing about the torque that keeps the vehicle in its place [Nm]."""
        self._hold_nm = torque_nm

    def torque_nm(self, time_s: float, speed_rad_s: float) -> float:
        """Torque towards the turning speed [Nm]."""
        if self._direction * self._speed.update(speed_rad_s) >= self._turning_speed_rad_s:
            self._direction = -self._direction
        return self._hold_nm + self._direction * self._swing_nm
