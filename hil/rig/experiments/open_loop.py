"""Torque without a controller, from standstill: what proves signs and scales before any loop relies on them.

A speed control whose feedback has the wrong sign drives away. Here nothing is fed back: the torque is a course over
time, the speed is only watched, and the first cycle refuses a vehicle that moves.
"""

from __future__ import annotations

import math

from hil.errors import RunAborted
from hil.rig.experiments.base import BaseTorque, Phase
from hil.rig.experiments.laws import Rest
from hil.rig.experiments.staged import LowPass

MOVING_RAD_S = 0.5
"""Speed above which a vehicle does not stand [rad/s]: the tolerance of an approach to standstill."""

STANDING_S = 0.2
"""The speed is averaged over so long before it is judged [s]: its noise is no motion."""


class OpenLoop:
    """A course of torque from standstill; measured from the first cycle, released at its end."""

    __slots__ = ("_course", "_most_rad_s", "_smooth", "_step_nm", "_torque_nm", "duration_s")

    def __init__(self, course: Rest, slew_nm_per_s: float, most_speed_rad_s: float, period_s: float) -> None:
        self.duration_s = course.duration_s
        self._course = course
        self._step_nm = slew_nm_per_s * period_s
        self._most_rad_s = most_speed_rad_s
        self._smooth = LowPass(STANDING_S, period_s)
        self._torque_nm = 0.0

    def torque(self, time_s: float, speed_rad_s: float) -> BaseTorque:
        """Torque and phase of one cycle; see `hil.rig.experiments.base.Experiment`."""
        self._watch(time_s, speed_rad_s)
        if time_s <= self.duration_s - 1e-9:
            phase, wanted_nm = Phase.MEASURE, self._course.torque_nm(time_s)
        else:
            phase, wanted_nm = Phase.DONE if self._torque_nm == 0.0 else Phase.RELEASE, 0.0
        self._torque_nm = max(self._torque_nm - self._step_nm, min(self._torque_nm + self._step_nm, wanted_nm))
        return BaseTorque(self._torque_nm, phase)

    def _watch(self, time_s: float, speed_rad_s: float) -> None:
        begins = math.isnan(self._smooth.value)
        if begins and not abs(speed_rad_s) <= MOVING_RAD_S:
            raise RunAborted(
                f"standstill test: the speed is {speed_rad_s:.2f} rad/s at the beginning, expected standstill "
                f"(within {MOVING_RAD_S:g} rad/s). Brake to a stand, release the brake, and begin again."
            )
        smooth_rad_s = self._smooth.update(speed_rad_s)
        if not abs(smooth_rad_s) <= self._most_rad_s:
            raise RunAborted(
                f"standstill test: the speed is {smooth_rad_s:.2f} rad/s after {time_s:.2f} s, expected at most "
                f"{self._most_rad_s:g} rad/s either way. Look for a grade, another source of torque, or a wrong scale "
                "of torque, speed or inertia."
            )
