"""The speed band of a run: an experiment that ends itself where the vehicle goes where it was not expected.

The band is the vehicle's: the motor shaft rings about it by several rad/s, so that its speed is low-passed first. The
PLC's speed limit holds for the speed as it is (`hil.rig.plc_watch`).
"""

from __future__ import annotations

from dataclasses import dataclass

from hil.errors import RunAborted
from hil.rig.experiments.base import BaseTorque, Experiment
from hil.rig.experiments.low_pass import LowPass

FILTER_S = 0.2
"""Low-pass of the speed [s]: a resonance at 8 Hz is a tenth of itself behind it."""

MARGIN_SHARE = 0.25
"""How far a speed may leave its predicted range, in parts of the range: grade and drag are not in the prediction."""


@dataclass(slots=True)
class WithinBand:
    """An experiment inside a speed band.

    Where the vehicle rolls at the beginning, the band reaches from there.

    Attributes
    ----------
    experiment
        What is driven.
    low_rad_s, high_rad_s
        Ends of the band [rad/s].
    margin_rad_s
        What the speed at the beginning is given next to it.
    period_s
        Time between two cycles [s].
    """

    experiment: Experiment
    low_rad_s: float
    high_rad_s: float
    margin_rad_s: float
    period_s: float
    _speed: LowPass | None = None

    @property
    def duration_s(self) -> float:
        """Length of the measured part [s]."""
        return self.experiment.duration_s

    def torque(self, time_s: float, speed_rad_s: float) -> BaseTorque:
        """Torque and phase of one cycle; see `hil.rig.experiments.base.Experiment`.

        Raises
        ------
        RunAborted
            If the speed is outside the band.
        """
        if self._speed is None:
            self._speed = LowPass(FILTER_S, self.period_s)
            self.low_rad_s = min(self.low_rad_s, speed_rad_s - self.margin_rad_s)
            self.high_rad_s = max(self.high_rad_s, speed_rad_s + self.margin_rad_s)
        smooth_rad_s = self._speed.update(speed_rad_s)
        if not self.low_rad_s <= smooth_rad_s <= self.high_rad_s:
            raise RunAborted(
                f"speed band: the speed is {smooth_rad_s:.1f} rad/s, expected {self.low_rad_s:.1f} to "
                f"{self.high_rad_s:.1f} rad/s, what was predicted and a margin. The run was ended at zero torque. Look "
                "for a grade, a wrong sign, or an inertia in the rig file that is far off."
            )
        return self.experiment.torque(time_s, speed_rad_s)


def margin_rad_s(low_rad_s: float, high_rad_s: float, least_rad_s: float) -> float:
    """Return the margin of a predicted range [rad/s]."""
    return max(least_rad_s, MARGIN_SHARE * (high_rad_s - low_rad_s))
