"""The driveline on a road, as the plant of a simulated rig: linear, so that its truth is exactly known.

Both torques are held over a period, as inverters and road are asked once in each.
"""

from __future__ import annotations

import numpy as np

from hil.figures.line import TwoMassLine
from hil.figures.road.road_load import RoadLoad


class RoadPlant:
    """A two-mass driveline under the load torque of a road.

    Parameters
    ----------
    line
        The driveline, with the payload's part of J_L.
    load
        Of the road.
    metres_per_rad
        Metres driven per radian of the motor.
    speed_rad_s
        Speed it rolls at in the beginning, at the motor shaft [rad/s].
    period_s
        Time of one step [s].
    """

    __slots__ = ("_a", "_b", "_distance_m", "_load", "_metres_per_rad", "_period_s", "_x")

    def __init__(
        self, line: TwoMassLine, load: RoadLoad, metres_per_rad: float, speed_rad_s: float, period_s: float
    ) -> None:
        self._a, self._b = line.discrete(period_s)
        self._load = load
        self._metres_per_rad = metres_per_rad
        self._period_s = period_s
        self._distance_m = 0.0
        self._x = np.array([speed_rad_s, speed_rad_s, 0.0])

    @property
    def speed_rad_s(self) -> float:
        """True motor speed now [rad/s]."""
        return float(self._x[0])

    def advance(self, torque_nm: tuple[float, float], duration_s: float) -> None:
        """Let the driveline run with both torques held [Nm] for one period."""
        if duration_s != self._period_s:
            raise ValueError(
                f"road: asked for a step of {duration_s:g} s, expected the {self._period_s:g} s it was made for. "
                "Make the plant with the rig's own period_s."
            )
        load_speed_rad_s = float(self._x[1])
        load_nm = self._load.torque_nm(load_speed_rad_s, self._distance_m, duration_s)
        self._x = self._a @ self._x + self._b @ np.array([sum(torque_nm), load_nm])
        self._distance_m += load_speed_rad_s * self._metres_per_rad * duration_s
