"""Tip-in and tip-out: steps up and down about a speed, as a driver's foot makes them."""

from __future__ import annotations


class Tip:
    """Steps of torque about what holds the speed: up for one step, down for the next.

    A step larger than the holding torque takes the driveline through zero torque, where backlash lies.
    """

    __slots__ = ("_duration_s", "_hold_nm", "_start_speed_rad_s", "_step_nm", "_step_s")

    def __init__(self, speed_rad_s: float, step_nm: float, step_s: float, duration_s: float) -> None:
        self._start_speed_rad_s = speed_rad_s
        self._step_nm = step_nm
        self._step_s = step_s
        self._duration_s = duration_s
        self._hold_nm = 0.0

    @property
    def start_speed_rad_s(self) -> float:
        """The speed it begins at [rad/s]."""
        return self._start_speed_rad_s

    @property
    def duration_s(self) -> float:
        """Length of the measured part [s]."""
        return self._duration_s

    def begin(self, torque_nm: float) -> None:
        """Step about the torque that holds the speed [Nm]."""
        self._hold_nm = torque_nm

    def torque_nm(self, time_s: float, speed_rad_s: float) -> float:
        """Torque of the step that runs now [Nm]; the first half step is up, so that the mean speed stays."""
        steps_begun = int(time_s / self._step_s + 0.5)
        return self._hold_nm + (self._step_nm if steps_begun % 2 == 0 else -self._step_nm)
