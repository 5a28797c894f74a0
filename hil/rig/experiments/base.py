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

    torque_nm: float
    phase: Phase


class Experiment(Protocol):
    """A plan that answers each cycle with a base torque."""

    @property
    def duration_s(self) -> float: ...  # of the measured part

    def torque(self, time_s: float, speed_rad_s: float) -> BaseTorque: ...  # of one cycle


class MeasureLaw(Protocol):
    """The law that makes one kind of experiment: its torque during the measured part."""

    @property
    def start_speed_rad_s(self) -> float: ...  # what the vehicle must have when the measured part begins

    @property
    def duration_s(self) -> float: ...

    def begin(self, torque_nm: float) -> None: ...  # takes over at the torque that holds the start speed

    def torque_nm(self, time_s: float, speed_rad_s: float) -> float: ...  # since the beginning of the measured part
