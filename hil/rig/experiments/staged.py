"""The course every experiment takes: approach, measure, release; limited in torque and in rate throughout.

The vehicle is brought to the start speed, and held there, by a PI controller slow enough to carry it without taking
part in its driveline's dynamics::

    speed_f' = (speed - speed_f) / filter_s                         first-order low-pass
    torque   = gain * (target - speed_f) + integral                 limited to +-limit
    integral' = gain / reset_s * (target - speed_f)                 stands still while the torque is limited

The loop's crossover is ``gain / J / 2 pi`` hertz for a total inertia J. `HoldTuning.for_bandwidth` chooses
gain and times by one bandwidth: the low-pass a factor 5 above the crossover and the integral a factor 5
below, which leaves a phase margin of 90 - 2 * atan(1/5) = 67 degrees on a pure inertia.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from hil.errors import RunAborted
from hil.rig.experiments.base import BaseTorque, MeasureLaw, Phase

SEPARATION = 5.0
"""Ratio between low-pass, crossover and integral corner frequencies; see the module's text."""

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


class LowPass:
    """Low-pass one signal; it starts at the first value it is given."""

    __slots__ = ("_share", "value")

    def __init__(self, time_constant_s: float, period_s: float) -> None:
        self._share = 1.0 - math.exp(-period_s / time_constant_s)
        self.value = math.nan

    def update(self, value: float) -> float:
        """Take the value of this cycle and return the low-passed one."""
        self.value = value if math.isnan(self.value) else self.value + self._share * (value - self.value)
        return self.value


@dataclass(frozen=True, slots=True)
class HoldTuning:
    """Gain [Nm s/rad], reset time [s] and low-pass time constant [s] of a speed hold."""

    gain_nm_s_per_rad: float  # `gain` of the module's text
    reset_s: float  # longer: the integral follows more slowly
    filter_s: float  # of the speed

    @classmethod
    def for_bandwidth(cls, bandwidth_hz: float, inertia_kg_m2: float) -> HoldTuning:
        """Tune for a crossover at ``bandwidth_hz`` [Hz] on a total inertia [kg m²]."""
        omega = 2.0 * math.pi * bandwidth_hz
        return cls(omega * inertia_kg_m2, SEPARATION / omega, 1.0 / (SEPARATION * omega))


class SpeedHold:
    """Hold a speed by torque, one call per cycle."""

    __slots__ = ("_integral_nm", "_limit_nm", "_period_s", "_speed", "_target_rad_s", "_tuning")

    def __init__(self, target_rad_s: float, tuning: HoldTuning, limit_nm: float, period_s: float) -> None:
        self._target_rad_s = target_rad_s
        self._tuning = tuning
        self._limit_nm = limit_nm
        self._period_s = period_s
        self._integral_nm = 0.0
        self._speed = LowPass(tuning.filter_s, period_s)

    def start_from(self, torque_nm: float) -> None:
        """Take over at a torque [Nm] that already holds the speed: the integral starts there."""
        self._integral_nm = torque_nm

    def torque_nm(self, speed_rad_s: float) -> float:
        """Torque of this cycle [Nm] for the measured speed [rad/s]."""
        self._speed.update(speed_rad_s)
        proportional_nm = self._tuning.gain_nm_s_per_rad * self.error_rad_s
        wanted_nm = proportional_nm + self._integral_nm
        given_nm = max(-self._limit_nm, min(self._limit_nm, wanted_nm))
        if given_nm == wanted_nm:
            self._integral_nm += proportional_nm * self._period_s / self._tuning.reset_s
        return given_nm

    @property
    def error_rad_s(self) -> float:
        """Target minus low-passed speed [rad/s]; NaN before the first cycle."""
        return self._target_rad_s - self._speed.value


class Approach:
    """Speed control up to a start speed."""

    def __init__(
        self, speed_rad_s: float, inertia_kg_m2: float, torque_limit_nm: float, period_s: float, timeout_s: float
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


@dataclass(frozen=True, slots=True)
class TorqueBounds:
    """The plan's own bounds on its base torque: magnitude [Nm] and rate [Nm/s].

    They keep a plan inside what was configured; the torque guard stands behind them and knows nothing of
    plans.
    """

    torque_nm: float  # torque_nm of the experiment, both inverters together
    slew_nm_per_s: float  # slew_nm_per_s of the experiment


class StagedExperiment:
    """One law, led up to and let out of safely."""

    __slots__ = ("_approach", "_bounds", "_law", "_measure_from_s", "_period_s", "_phase", "_torque_nm", "duration_s")

    def __init__(self, law: MeasureLaw, approach: Approach, bounds: TorqueBounds, period_s: float) -> None:
        self.duration_s = law.duration_s
        self._law = law
        self._approach = approach
        self._bounds = bounds
        self._period_s = period_s
        self._phase = Phase.APPROACH
        self._measure_from_s = 0.0
        self._torque_nm = 0.0

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
            if time_s - self._measure_from_s > self.duration_s - half_period_s:
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
