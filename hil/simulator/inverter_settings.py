"""What a simulated inverter is, and what is wrong with it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from drivers.cia402 import TorqueMode


@dataclass(frozen=True, slots=True)
class FaultAtStep:
    """A fault the drive meets at one step.

    Attributes
    ----------
    step
        Counts the SYNCs from 1; 0 is a fault from power-on.
    emcy_code
        Error code of CiA 301 and CiA 402, for EMCY and object 0x603F.
    """

    step: int
    emcy_code: int


@dataclass(frozen=True, slots=True)
class InverterFaults:
    """What is wrong with a simulated inverter; by default nothing.

    Attributes
    ----------
    absent
        It is not on the bus at all.
    hang_at_step
        At this SYNC, 0 from the start, its program stops while the link stays up: no torque, no answer.
    fault
        A fault it meets.
    identity
        Another vendor-ID and product code than the EDS's.
    velocity_unit
        Another value of 0x60A9 than the EDS's.
    ignored_writes
        Objects whose writes it acknowledges and forgets: 0x6060 for a mode that does not come, 0x6040 for a
        state machine that is stuck, 0x1A00 for a mapping that does not hold.
    """

    absent: bool = False
    hang_at_step: int | None = None
    fault: FaultAtStep | None = None
    identity: tuple[int, int] | None = None
    velocity_unit: int | None = None
    ignored_writes: frozenset[int] = frozenset()


@dataclass(frozen=True, slots=True)
class SimulatedInverter:
    """One simulated inverter.

    Attributes
    ----------
    node_id
        CANopen node id.
    rated_torque_nm
        Motor rated torque; a torque count is 0.1 % of it [Nm].
    supported_modes
        Modes of operation it knows; it refuses others.
    torque_noise_counts
        Standard deviation of the torque reading, in counts.
    speed_noise_rad_s
        Standard deviation of the speed reading [rad/s].
    eds_path
        Its EDS; None for the one that is shipped.
    faults
        What is wrong with it.
    """

    node_id: int
    rated_torque_nm: float = 600.0
    supported_modes: frozenset[TorqueMode] = frozenset(TorqueMode)
    torque_noise_counts: float = 1.0
    speed_noise_rad_s: float = 0.05
    eds_path: Path | None = None
    faults: InverterFaults = InverterFaults()
