"""What an experiment is: a base torque for every cycle, in four phases that always end at zero torque.

::

    APPROACH  bring the vehicle to the start speed; driven, not recorded
    MEASURE   the experiment proper; recorded, PRBS superposed
    RELEASE   ramp to zero torque; driven, not recorded
    DONE      zero torque, nothing follows

An experiment reads no clock and no bus: time and speed are arguments, so that the same plan runs on the
rig, in a test and in a dry run.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Protocol


class Phase(Enum):
    """Where in its course an experiment is."""

    APPROACH = "approach"
    MEASURE = "measure"
    RELEASE = "release"
    DONE = "done"


@dataclass(frozen=True, slots=True)
class BaseTorque:
    """The torque an experiment asks of both inverters together, PRBS excluded [Nm], and its phase."""

    torque_nm: float  # positive forward
    phase: Phase  # that this cycle belongs to


class Experiment(Protocol):
    """A plan that answers each cycle with a base torque."""

    @property
    def duration_s(self) -> float:
        """Length of the measured part [s]."""

    def torque(self, time_s: float, speed_rad_s: float) -> BaseTorque:
        """Return torque and phase of a cycle, by the time since the first [s] and the motor speed [rad/s]."""


class MeasureLaw(Protocol):
    """The law that makes one kind of experiment: its torque during the measured part."""

    @property
    def start_speed_rad_s(self) -> float:
        """Motor speed that the vehicle has to have before the measured part begins [rad/s]."""

    @property
    def duration_s(self) -> float:
        """Length of the measured part [s]."""

    def begin(self, torque_nm: float) -> None:
        """Take over at the base torque that holds the start speed [Nm]; called once."""

    def torque_nm(self, time_s: float, speed_rad_s: float) -> float:
        """Return the base torque wanted [Nm], by the time since the measured part began [s] and the speed [rad/s]."""
