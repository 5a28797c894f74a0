"""Bring the vehicle to the start speed and notice when it is there."""

from __future__ import annotations

import math

from hil.errors import RunAborted
from hil.rig.experiments.speed_hold import HoldTuning, SpeedHold

BANDWIDTH_HZ = 0.1
"""Crossover of the approach's speed loop [Hz]: 50 times below the 5 Hz the paper begins at."""

SETTLED_FOR_S = 1.0
"""The mean speed is taken over so long [s]: several periods of any driveline resonance, several turns of the motor,
so that a resolver whose error goes round with the shaft does not keep the vehicle from ever being there."""

STEADY_WITHIN_RAD_S = 0.05
"""How far that mean may move from one such time to the next [rad/s].

What is handed over is then the torque that holds the speed, to within 0.05 rad/s² times the inertia: 5 Nm
for 100 kg m².
"""

TOLERANCE_SHARE = 0.02
"""Part of the start speed within which the vehicle counts as there."""

TOLERANCE_LEAST_RAD_S = 0.5
"""The tolerance at and near standstill [rad/s]: ten times the speed noise assumed in docs (0.05 rad/s)."""


class Approach:
    """Speed control up to a start speed.

    Parameters
    ----------
    speed_rad_s
        The start speed [rad/s].
    inertia_kg_m2
        Total inertia at the motor shaft [kg m²], as well as it is known; it tunes the loop.
    torque_limit_nm
        Largest torque [Nm].
    period_s
        Time between two cycles [s].
    timeout_s
        Time in which the vehicle must be there [s].
    """

    __slots__ = (
        "_errors_rad_s",
        "_hold",
        "_mean_rad_s",
        "_mean_since_s",
        "_speed_rad_s",
        "_timeout_s",
        "_tolerance_rad_s",
        "settled",
    )

    def __init__(
        self,
        speed_rad_s: float,
        inertia_kg_m2: float,
        torque_limit_nm: float,
        period_s: float,
        timeout_s: float,
    ) -> None:
        tuning = HoldTuning.for_bandwidth(BANDWIDTH_HZ, inertia_kg_m2)
        self._hold = SpeedHold(speed_rad_s, tuning, torque_limit_nm, period_s)
        self._speed_rad_s = speed_rad_s
        self._timeout_s = timeout_s
        self._tolerance_rad_s = max(TOLERANCE_LEAST_RAD_S, TOLERANCE_SHARE * abs(speed_rad_s))
        self._mean_since_s = 0.0
        self._mean_rad_s = math.inf
        self._errors_rad_s: list[float] = []
        self.settled = False

    def torque_nm(self, time_s: float, speed_rad_s: float) -> float:
        """Torque of this cycle [Nm]; sets ``settled`` once the vehicle is there."""
        torque_nm = self._hold.torque_nm(speed_rad_s)
        self.settled = self._is_steady(time_s)
        if not self.settled and time_s >= self._timeout_s:
            raise RunAborted(
                f"approach: the speed is {speed_rad_s:.2f} rad/s after {self._timeout_s:.0f} s, expected it "
                f"steady at {self._speed_rad_s:.2f} +- {self._tolerance_rad_s:.2f} rad/s. Check brakes, gear "
                "and grade, or raise the torque of the experiment in the rig file."
            )
        return torque_nm

    def _is_steady(self, time_s: float) -> bool:
        self._errors_rad_s.append(self._hold.error_rad_s)
        if time_s - self._mean_since_s < SETTLED_FOR_S:
            return False
        mean_rad_s = sum(self._errors_rad_s) / len(self._errors_rad_s)
        moved_rad_s = abs(mean_rad_s - self._mean_rad_s)
        self._mean_since_s, self._mean_rad_s, self._errors_rad_s = time_s, mean_rad_s, []
        return abs(mean_rad_s) <= self._tolerance_rad_s and moved_rad_s <= STEADY_WITHIN_RAD_S
