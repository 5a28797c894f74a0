"""One cycle of the rig: what was commanded and what every device answered, in SI units."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag


class SampleFlag(IntFlag):
    """Quality of one sample; 0 is good."""

    GOOD = 0
    M1_STALE = 1  # inverter m1 did not answer this SYNC: its last value is repeated
    M2_STALE = 2
    LATE = 4  # the cycle started later than half a period after its time
    PLC_STALE = 8
    M1_LIMITED = 16  # an internal limit of m1 acts (statusword bit 11): less torque than asked for, read as ever
    M2_LIMITED = 32
    CHANNEL_LOST = 64  # a further channel was not read in this cycle, and is NaN
    M1_DOUBTFUL = 128  # a reading of m1 was outside what is expected (`drivers.inverter.supervision`)
    M2_DOUBTFUL = 256


REMARKS = SampleFlag.M1_LIMITED | SampleFlag.M2_LIMITED | SampleFlag.CHANNEL_LOST
"""Flags of samples whose torque and speed count all the same: what was read is what was."""


@dataclass(frozen=True, slots=True)
class Sample:
    """One SYNC cycle. SI units; ``time_s`` counts from the first recorded cycle, ``t_ns`` is host time.

    ``torque_*_nm`` and ``speed_rad_s`` are NaN where a device has never answered yet. ``age_ns`` is the age
    of the oldest of the values at the end of the cycle. ``channels`` are the further ones of the rig file, in its
    order; NaN where one was not read in this cycle.
    """

    cycle: int  # from 0 at the first cycle of the run, counting those that were missed
    t_ns: int
    time_s: float
    torque_ref_m1_nm: float  # asked of inverter m1, PRBS and damper included; what the PLC adds is not in it
    torque_ref_m2_nm: float  # the same of inverter m2
    prbs_nm: float  # both inverters together; the PLC's own is NaN between its reports
    torque_m1_nm: float  # 0x6077 of inverter m1; repeated where it did not answer
    torque_m2_nm: float  # the same of inverter m2
    speed_rad_s: float
    age_ns: int
    flags: SampleFlag  # `GOOD` where nothing is to be said
    channels: tuple[float, ...] = ()

    @property
    def counts(self) -> bool:
        """Whether the readings are those of this cycle; a flag that is a remark takes nothing from them."""
        return not self.flags & ~REMARKS

    @property
    def torque_ref_nm(self) -> float:
        """Total torque reference of both inverters, PRBS included [Nm]."""
        return self.torque_ref_m1_nm + self.torque_ref_m2_nm
