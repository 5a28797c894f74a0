"""Cruise: a nearly constant speed, the paper's own test. The PRBS does the work."""

from __future__ import annotations

from hil.rig.experiments.staged import HoldTuning, SpeedHold

BANDWIDTH_HZ = 0.01
"""Crossover of the speed loop while measuring [Hz].

The lowest frequency of interest is 0.3 Hz (where the estimators' high-pass begins): 30 times above the
crossover, and the loop's low-pass (at five times the crossover, see `speed_hold`) leaves it 1/30 * 1/6 =
0.6 % of the vehicle's own response there.
"""


class Cruise:
    """Hold the speed so slowly that the loop does not shape the response to the PRBS."""

    __slots__ = ("_duration_s", "_hold", "_start_speed_rad_s")

    def __init__(
        self,
        speed_rad_s: float,
        duration_s: float,
        inertia_kg_m2: float,
        torque_limit_nm: float,
        period_s: float,
    ) -> None:
        tuning = HoldTuning.for_bandwidth(BANDWIDTH_HZ, inertia_kg_m2)
        self._start_speed_rad_s = speed_rad_s
        self._duration_s = duration_s
        self._hold = SpeedHold(speed_rad_s, tuning, torque_limit_nm, period_s)

    @property
    def start_speed_rad_s(self) -> float:
        """The speed it holds [rad/s]."""
        return self._start_speed_rad_s

    @property
    def duration_s(self) -> float:
        """Length of the measured part [s]."""
        return self._duration_s

    def begin(self, torque_nm: float) -> None:
        """Take over at the torque that holds the speed [Nm]."""
        self._hold.start_from(torque_nm)

    def torque_nm(self, time_s: float, speed_rad_s: float) -> float:
        """Torque that holds the speed [Nm]."""
        return self._hold.torque_nm(speed_rad_s)
