"""What a simulated inverter is, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from drivers.capability.carrier import ObjectId
from drivers.capability.speed_unit import SpeedUnit
from drivers.inverter.cia402 import TorqueMode
from hil.simulator.torque_limits import DriveLimits


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
class WrongTorque:
    """A drive that gives another torque than it is asked for, and reports what it gives, from one step on.

    Attributes
    ----------
    step
        Counts the SYNCs from 1; None for never.
    gain
        It gives so many times what it is asked for; -1 is the other way round.
    offset_permille
        And so much more [per mille of rated].
    """

    step: int | None = None
    gain: float = 1.0
    offset_permille: float = 0.0

    def given(self, wanted_permille: float, step: int) -> float:
        """Torque it gives at a step [per mille of rated]."""
        if self.step is None or step < self.step:
            return wanted_permille
        return self.gain * wanted_permille + self.offset_permille


@dataclass(frozen=True, slots=True)
class InverterFaults:
    """What is wrong with a simulated inverter; by default nothing. Steps count the SYNCs; 0 is power-on.

    Attributes
    ----------
    absent
        It is not on the bus at all.
    hang_at_step
        Its program stops while the link stays up: no torque, no answer.
    reset_at_step
        It starts anew, with the values of its EDS.
    bus_off_at_step
        Its CAN controller leaves the bus; the drive notices and acts as 0x6007 says.
    stale_from_step
        Its TPDOs repeat what the one before this step said.
    stale_share
        Share of TPDOs that repeat what the one before them said, at random: a drive too slow for its SYNC.
    ignores_target_from_step
        It ignores the target torque from this step on, in operation, and says so in bit 12 of its statusword.
    wrong_torque
        It gives another torque than it is asked for.
    fault
        A fault it meets.
    emcy
        An emergency it tells, without a fault.
    brown_out_at_step
        Its DC link is no longer supplied.
    identity
        Another vendor-ID and product code than the EDS's.
    velocity_unit
        Another value of 0x60A9 than the EDS's.
    ignored_writes
        Objects whose writes it acknowledges and forgets: 0x6060 for a mode that does not come, 0x6040 for a
        state machine that is stuck, 0x1A00 for a mapping that does not hold.
    missing_objects, locked_objects
        Objects of the EDS it does not have, and such as it does not let be written.
    clock_drift_ppm
        It samples by a clock of its own that runs slow by so much, instead of by SYNC [parts per million].
    limits
        Limits it sets itself.
    """

    absent: bool = False
    hang_at_step: int | None = None
    reset_at_step: int | None = None
    bus_off_at_step: int | None = None
    stale_from_step: int | None = None
    stale_share: float = 0.0
    ignores_target_from_step: int | None = None
    wrong_torque: WrongTorque = field(default_factory=WrongTorque)
    fault: FaultAtStep | None = None
    emcy: FaultAtStep | None = None
    brown_out_at_step: int | None = None
    identity: tuple[int, int] | None = None
    velocity_unit: int | None = None
    ignored_writes: frozenset[int] = frozenset()
    missing_objects: frozenset[int] = frozenset()
    locked_objects: frozenset[int] = frozenset()
    clock_drift_ppm: float = 0.0
    limits: DriveLimits = field(default_factory=DriveLimits)


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
    identity
        Vendor-ID and product code where its EDS has none.
    speed_unit
        Unit of its velocity actual value where its EDS has none.
    rated_torque_unit_nm
        What one count of its object 0x6076 is [Nm].
    sensors
        What reads the objects of further sensors at it, in counts.
    faults
        What is wrong with it.
    """

    node_id: int
    rated_torque_nm: float = 600.0
    supported_modes: frozenset[TorqueMode] = frozenset(TorqueMode)
    torque_noise_counts: float = 1.0
    speed_noise_rad_s: float = 0.05
    eds_path: Path | None = None
    identity: tuple[int, int] = (0, 0)
    speed_unit: SpeedUnit | None = None
    rated_torque_unit_nm: float = 1e-3
    sensors: Mapping[ObjectId, Callable[[], int]] = field(default_factory=dict)
    faults: InverterFaults = InverterFaults()
