"""Coast and ramp: what shows where the torque is zero, or changes slowly."""

from __future__ import annotations


class Coast:
    """No torque from a speed on: what slows the vehicle is its own.

    Parameters
    ----------
    speed_rad_s
        Speed at the beginning [rad/s].
    duration_s
        Length of the measured part [s].
    """

    __slots__ = ("_duration_s", "_start_speed_rad_s")

    def __init__(self, speed_rad_s: float, duration_s: float) -> None:
        self._start_speed_rad_s = speed_rad_s
        self._duration_s = duration_s

    @property
    def start_speed_rad_s(self) -> float:
        """The speed it begins at [rad/s]."""
        return self._start_speed_rad_s

    @property
    def duration_s(self) -> float:
        """Length of the measured part [s]."""
        return self._duration_s

    def begin(self, torque_nm: float) -> None:
        """Let go of the torque that held the speed [Nm]."""

    def torque_nm(self, time_s: float, speed_rad_s: float) -> float:
        """Zero [Nm]."""
        return 0.0


class Ramp:
    """Torque that rises and falls evenly about what keeps the vehicle in its place, through zero.

    Parameters
    ----------
    swing_nm
        Largest torque either way [Nm].
    ramp_s
        Time from the middle to it [s].
    duration_s
        Length of the measured part [s].
    """

    __slots__ = ("_duration_s", "_hold_nm", "_ramp_s", "_swing_nm")

    def __init__(self, swing_nm: float, ramp_s: float, duration_s: float) -> None:
        self._swing_nm = swing_nm
        self._ramp_s = ramp_s
        self._duration_s = duration_s
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
        """Torque of the triangle [Nm]: up, down through zero, and back, in four ramps."""
        quarter = (time_s / self._ramp_s) % 4.0
        share = quarter if quarter < 1.0 else 2.0 - quarter if quarter < 3.0 else quarter - 4.0
        return self._hold_nm + self._swing_nm * share
