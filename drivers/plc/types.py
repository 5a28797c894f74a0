"""What the PLC says and what it is asked for, in SI units and enumerations; nothing of registers."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class DriveMode(Enum):
    """How the hybrid driveline is coupled; the value is the name in the register map."""

    SERIES = "series"  # the inverters drive the wheels, the coupling to the engine is open
    PARALLEL = "parallel"  # the engine is coupled to the motor shaft
    ELECTRIC = "electric"  # as series, with the engine off


class ClutchState(Enum):
    """The coupling between engine and motor shaft; the value is the name in the register map."""

    OPEN = "open"
    CLOSED = "closed"


class PrbsSource(Enum):
    """Who makes the pseudo-random binary torque; the value is the name in map and rig file."""

    PLC = "plc"
    HOST = "host"


@dataclass(frozen=True, slots=True)
class PrbsSettings:
    """The PLC's pseudo-random binary torque: a ten-cell shift register."""

    enabled: bool  # whether the PLC's generator runs
    amplitude_nm: float  # the level is plus or minus this torque, both inverters together [Nm]
    clock_divider: int  # PLC cycles each level is held
    seed: int  # first state of the register, 1 to 1023
    source: PrbsSource  # who makes the PRBS


@dataclass(frozen=True, slots=True)
class PlcStatus:
    """Everything the PLC reports."""

    drive_mode: DriveMode  # in effect
    clutch: ClutchState  # coupling of engine and motor shaft
    permissive: bool  # whether torque is permitted
    speed_limit_rad_s: float  # largest permitted motor speed
    torque_limit_nm: float  # largest permitted torque of one inverter
    plc_count: int  # its sign of life
    prbs: PrbsSettings  # the settings its own generator holds
    prbs_torque_nm: float  # that the PLC adds itself [Nm]
    t_ns: int  # when the first of the requests for it left, on the host's monotonic clock

    def age_ns(self, now_ns: int) -> int:
        """How old the oldest value may be at ``now_ns`` of the same clock [ns]."""
        return now_ns - self.t_ns
