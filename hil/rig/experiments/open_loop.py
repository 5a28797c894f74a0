"""Torque without a controller, from standstill: what proves signs and scales before any loop relies on them.

A speed control whose feedback has the wrong sign drives away. Here nothing is fed back: the torque is a course over
time, the speed is only watched, and the first cycle refuses a vehicle that moves.
"""

from __future__ import annotations

import math
from typing import Protocol

from hil.errors import RunAborted
from hil.rig.experiments.base import BaseTorque, Phase

MOVING_RAD_S = 0.5
"""Speed above which a vehicle does not stand [rad/s]: the tolerance of an approach to standstill."""

STANDING_S = 0.2
"""The speed is averaged over so long before it is judged [s]: its noise is no motion."""


class Course(Protocol):
    """A torque over time."""

    @property
    def duration_s(self) -> float:
        """Length [s]."""
        ...

    def torque_nm(self, time_s: float) -> float:
        """Torque at a time [Nm]."""
        ...


class OpenLoop:
    """A course of torque from standstill; measured from the first cycle, released at its end."""

    __slots__ = ("_course", "_most_rad_s", "_phase", "_share", "_speed_rad_s", "_step_nm", "_torque_nm")

    def __init__(self, course: Course, slew_nm_per_s: float, most_speed_rad_s: float, period_s: float) -> None:
        self._course = course
        self._step_nm = slew_nm_per_s * period_s
        self._most_rad_s = most_speed_rad_s
        self._share = 1.0 - math.exp(-period_s / STANDING_S)
        self._speed_rad_s: float | None = None
        self._torque_nm = 0.0
        self._phase = Phase.MEASURE

    @property
    def duration_s(self) -> float:
        """Length of the measured part [s]."""
        return self._course.duration_s

    def torque(self, time_s: float, speed_rad_s: float) -> BaseTorque:
        """Torque and phase of one cycle; see `hil.rig.experiments.base.Experiment`."""
        self._watch(time_s, speed_rad_s)
        over = time_s > self._course.duration_s - 1e-9
        self._phase = Phase.MEASURE if not over else Phase.RELEASE
        wanted_nm = 0.0 if over else self._course.torque_nm(time_s)
        if over and self._torque_nm == 0.0:
            self._phase = Phase.DONE
        self._torque_nm = max(self._torque_nm - self._step_nm, min(self._torque_nm + self._step_nm, wanted_nm))
        return BaseTorque(self._torque_nm, self._phase)

    def _watch(self, time_s: float, speed_rad_s: float) -> None:
        if self._speed_rad_s is None:
            self._speed_rad_s = speed_rad_s
            if not abs(speed_rad_s) <= MOVING_RAD_S:
                raise RunAborted(
                    f"standstill test: the speed is {speed_rad_s:.2f} rad/s at the beginning, expected standstill "
                    f"(within {MOVING_RAD_S:g} rad/s). Brake to a stand, release the brake, and begin again."
                )
        self._speed_rad_s += self._share * (speed_rad_s - self._speed_rad_s)
        if not abs(self._speed_rad_s) <= self._most_rad_s:
            raise RunAborted(
                f"standstill test: the speed is {self._speed_rad_s:.2f} rad/s after {time_s:.2f} s, expected at most "
                f"{self._most_rad_s:g} rad/s either way. Look for a grade, another source of torque, or a wrong scale "
                "of torque, speed or inertia."
            )
