"""A driver at near-constant speed: the slow hold of a cruise, and corrections by the pedal on top of it.

The corrections come at random moments, are held until the next one, and follow the foot with a lag. They do not depend
on the speed of the moment: what a driver feels of the driveline's oscillation, he does not answer at 8 Hz.
"""

from __future__ import annotations

import numpy as np

from hil.rig.experiments.cruise import Cruise
from hil.rig.experiments.low_pass import LowPass

LAG_S = 0.25
"""Time constant of the foot [s]."""

SHORTEST_S, LONGEST_S = 1.5, 6.0
"""Time between two corrections [s]."""


class PedalCruise:
    """The law of one measured part; see `hil.rig.experiments.base.MeasureLaw`.

    Parameters
    ----------
    cruise
        What holds the speed.
    pedal_nm
        Standard deviation of the corrections [Nm].
    period_s
        Time between two cycles [s].
    rng
        What they are drawn from.
    """

    __slots__ = ("_cruise", "_foot", "_next_s", "_pedal_nm", "_rng", "_wanted_nm")

    def __init__(self, cruise: Cruise, pedal_nm: float, period_s: float, rng: np.random.Generator) -> None:
        self._cruise = cruise
        self._pedal_nm = pedal_nm
        self._rng = rng
        self._foot = LowPass(LAG_S, period_s)
        self._wanted_nm = 0.0
        self._next_s = 0.0

    @property
    def start_speed_rad_s(self) -> float:
        """The speed that is held [rad/s]."""
        return self._cruise.start_speed_rad_s

    @property
    def duration_s(self) -> float:
        """Length of the measured part [s]."""
        return self._cruise.duration_s

    def begin(self, torque_nm: float) -> None:
        """Take over at the torque that holds the speed [Nm]."""
        self._cruise.begin(torque_nm)

    def torque_nm(self, time_s: float, speed_rad_s: float) -> float:
        """Torque of the driver's foot [Nm]."""
        self._foot.update(self._wanted_nm)
        if time_s >= self._next_s:
            self._wanted_nm = self._pedal_nm * float(self._rng.standard_normal())
            self._next_s += float(self._rng.uniform(SHORTEST_S, LONGEST_S))
        return self._cruise.torque_nm(time_s, speed_rad_s) + self._foot.value
