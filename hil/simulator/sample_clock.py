"""When a simulated drive samples whose converter is not locked to SYNC.

Its clock runs slow against the SYNC's by so many parts per million, so that what SYNC fetches grows older from
cycle to cycle, until it is a whole period old and the next sample is the fresh one.
"""

from __future__ import annotations


class SampleClock:
    """Age of what each SYNC fetches, and the values of that age.

    Parameters
    ----------
    drift_ppm
        How much slower than the SYNC's it runs [parts per million]; 0 for a drive that samples at SYNC.
    """

    __slots__ = ("_drift", "_speed_rad_s", "_steps", "_torque")

    def __init__(self, drift_ppm: float) -> None:
        self._drift = drift_ppm * 1e-6
        self._steps = 0
        self._speed_rad_s: float | None = None
        self._torque: float = 0.0

    def sample(self, speed_rad_s: float, torque: float) -> tuple[float, float]:
        """Take speed and torque at this SYNC, return them as sampled.

        Between two SYNCs the speed is taken to change evenly; the torque was that of the SYNC before.
        """
        age = (self._steps * self._drift) % 1.0
        before_rad_s = speed_rad_s if self._speed_rad_s is None else self._speed_rad_s
        sampled_rad_s = speed_rad_s - age * (speed_rad_s - before_rad_s)
        sampled_torque = torque if age == 0.0 else self._torque
        self._steps += 1
        self._speed_rad_s, self._torque = speed_rad_s, torque
        return sampled_rad_s, sampled_torque
