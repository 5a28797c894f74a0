"""The course every experiment takes: approach, measure, release; limited in torque and in rate throughout."""

from __future__ import annotations

from dataclasses import dataclass

from hil.rig.experiments.approach import Approach
from hil.rig.experiments.base import BaseTorque, MeasureLaw, Phase


@dataclass(frozen=True, slots=True)
class TorqueBounds:
    """The plan's own bounds on its base torque: magnitude [Nm] and rate [Nm/s].

    They keep a plan inside what was configured; the torque guard stands behind them and knows nothing of
    plans.
    """

    torque_nm: float
    slew_nm_per_s: float


class StagedExperiment:
    """One law, led up to and let out of safely.

    Parameters
    ----------
    law
        What to do in the measured part.
    approach
        How to get to its start speed.
    bounds
        Never left, in any phase.
    period_s
        Time between two cycles [s].
    """

    __slots__ = ("_approach", "_bounds", "_law", "_measure_from_s", "_period_s", "_phase", "_torque_nm")

    def __init__(self, law: MeasureLaw, approach: Approach, bounds: TorqueBounds, period_s: float) -> None:
        self._law = law
        self._approach = approach
        self._bounds = bounds
        self._period_s = period_s
        self._phase = Phase.APPROACH
        self._measure_from_s = 0.0
        self._torque_nm = 0.0

    @property
    def duration_s(self) -> float:
        """Length of the measured part [s]."""
        return self._law.duration_s

    def torque(self, time_s: float, speed_rad_s: float) -> BaseTorque:
        """Torque and phase of one cycle; see `hil.rig.experiments.base.Experiment`."""
        self._advance(time_s)
        wanted_nm = self._wanted_nm(time_s, speed_rad_s)
        self._torque_nm = self._bounded_nm(wanted_nm)
        return BaseTorque(self._torque_nm, self._phase)

    def _advance(self, time_s: float) -> None:
        if self._phase is Phase.APPROACH and self._approach.settled:
            self._phase = Phase.MEASURE
            self._measure_from_s = time_s
            self._law.begin(self._torque_nm)
        elif self._phase is Phase.MEASURE:
            half_period_s = self._period_s / 2.0
            if time_s - self._measure_from_s > self._law.duration_s - half_period_s:
                self._phase = Phase.RELEASE
        elif self._phase is Phase.RELEASE and self._torque_nm == 0.0:
            self._phase = Phase.DONE

    def _wanted_nm(self, time_s: float, speed_rad_s: float) -> float:
        if self._phase is Phase.APPROACH:
            return self._approach.torque_nm(time_s, speed_rad_s)
        if self._phase is Phase.MEASURE:
            return self._law.torque_nm(time_s - self._measure_from_s, speed_rad_s)
        return 0.0

    def _bounded_nm(self, wanted_nm: float) -> float:
        step_nm = self._bounds.slew_nm_per_s * self._period_s
        slewed_nm = max(self._torque_nm - step_nm, min(self._torque_nm + step_nm, wanted_nm))
        return max(-self._bounds.torque_nm, min(self._bounds.torque_nm, slewed_nm))
