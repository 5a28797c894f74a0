"""Names and units of the columns of a recording (CONTRACT: recordings)."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

TIME: Final = "time_s"
TORQUE_M1: Final = "torque_m1_nm"
TORQUE_M2: Final = "torque_m2_nm"
SPEED: Final = "speed_rad_s"
FLAGS: Final = "flags"

UNITS: Final = MappingProxyType(
    {
        TIME: "s",
        "torque_ref_nm": "Nm",
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
"""Column to unit, in the order a recording of the rig has them; ``flags`` is a bit field without unit."""
