"""Names and units of the columns of a recording (CONTRACT: recordings)."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

TIME: Final = "time_s"
TORQUE_M1: Final = "torque_m1_nm"
TORQUE_M2: Final = "torque_m2_nm"
SPEED: Final = "speed_rad_s"
REFERENCE: Final = "torque_ref_nm"
FLAGS: Final = "flags"
COUNTING_FLAGS: Final = tuple(range(0, 128, 16))
"""Flags of rows that count: good ones, those in which a drive's internal limit acts and the torque is read, and those
in which a further channel, which is NaN there, was not read."""


UNITS: Final = MappingProxyType(
    {
        TIME: "s",
        REFERENCE: "Nm",
        TORQUE_M1: "Nm",
        TORQUE_M2: "Nm",
        SPEED: "rad/s",
        "prbs_nm": "Nm",
        FLAGS: "",
        "torque_ref_m1_nm": "Nm",
        "torque_ref_m2_nm": "Nm",
        "age_s": "s",
    }
)
"""Column to unit, in the order a recording of the rig has them, before the channels of its rig file; ``flags`` is a bit
field without unit."""

COMMENTS: Final = MappingProxyType(
    {
        TIME: "time since the first recorded cycle",
        REFERENCE: "torque reference of both inverters, PRBS included",
        TORQUE_M1: "torque actual value of inverter m1 (0x6077)",
        TORQUE_M2: "torque actual value of inverter m2 (0x6077)",
        SPEED: "motor speed from the resolver (0x606C)",
        "prbs_nm": "PRBS part of the torque reference (0x60B2)",
        FLAGS: "quality: 0 good, 1 m1 stale, 2 m2 stale, 4 cycle late, 8 PLC stale, 16 m1 in its internal limit, "
        "32 m2 in its internal limit, 64 a further channel not read, added up",
        "torque_ref_m1_nm": "torque reference of inverter m1",
        "torque_ref_m2_nm": "torque reference of inverter m2",
        "age_s": "age of the oldest value of the row",
    }
)
"""Column to what it holds, for formats that have a place for it."""
