"""A PI speed controller slow enough to carry a vehicle without taking part in its driveline's dynamics.

::

    speed_f' = (speed - speed_f) / filter_s                         first-order low-pass
    torque   = gain * (target - speed_f) + integral                 limited to +-limit
    integral' = gain / reset_s * (target - speed_f)                 stands still while the torque is limited

The loop's crossover is ``gain / J / 2 pi`` hertz for a total inertia J. `SpeedHold.for_bandwidth` chooses
the three times from one bandwidth: the low-pass a factor 5 above the crossover and the integral a factor 5
below, which leaves a phase margin of 90 - 2 * atan(1/5) = 67 degrees on a pure inertia.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from hil.rig.experiments.low_pass import LowPass

SEPARATION = 5.0
"""Ratio between low-pass, crossover and integral corner frequencies; see the module's text."""


@dataclass(frozen=True, slots=True)
class HoldTuning:
    """Gain [Nm s/rad], reset time [s] and low-pass time constant [s] of a speed hold."""

    gain_nm_s_per_rad: float
    reset_s: float
    filter_s: float

    @classmethod
    def for_bandwidth(cls, bandwidth_hz: float, inertia_kg_m2: float) -> HoldTuning:
        """Tune for a crossover at ``bandwidth_hz`` [Hz] on a total inertia [kg m²]."""
        omega = 2.0 * math.pi * bandwidth_hz
        return cls(omega * inertia_kg_m2, SEPARATION / omega, 1.0 / (SEPARATION * omega))


class SpeedHold:
    """Hold a speed by torque, one call per cycle.

    Parameters
    ----------
    target_rad_s
        Speed to hold [rad/s].
    tuning
        How fast.
    limit_nm
        The torque never exceeds this magnitude [Nm].
    period_s
        Time between two calls [s].
    """

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
