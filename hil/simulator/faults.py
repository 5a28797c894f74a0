"""What can be wrong with each simulated device; by default nothing. `hil.simulator.fault_table` has the names."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import Enum
from operator import itemgetter
from typing import Final, Generic, TypeVar

from drivers.inverter.cia402 import PowerState

PDO_COB_IDS = range(0x180, 0x580)  # the PDOs of the predefined connection set (CiA 301)


T = TypeVar("T")

LATE_BY_S: Final = 1.5
"""How late a slow PLC answers [s of the wall clock]: beyond the second that a client waits."""


@dataclass(frozen=True, slots=True)
class AtStep(Generic[T]):
    """What happens at one step, or from it on. Steps count the SYNCs from 1, here and below; 0 is power-on."""

    step: int  # the first, or the only one
    what: T  # error code, state, share or time: as the field that holds it says


@dataclass(frozen=True, slots=True)
class WrongTorque:
    """A drive that gives another torque than it is asked for, and reports what it gives, from one step on.

    It gives ``gain`` times what it is asked for, -1 being the other way round, and ``offset_permille`` of its rated
    torque more.
    """

    step: int | None = None  # None: never
    gain: float = 1.0  # over what it is asked for
    offset_permille: float = 0.0  # of rated torque

    def given(self, wanted_permille: float, step: int) -> float:
        """Torque it gives at a step [per mille of rated]."""
        if self.step is None or step < self.step:
            return wanted_permille
        return self.gain * wanted_permille + self.offset_permille


@dataclass(frozen=True, slots=True)
class WrongSpeed:
    """A resolver that reads another speed than the motor has, from one step on: so many times it, or stuck there."""

    gain_from_step: int | None = None  # None: never
    gain: float = 1.0  # read over true; -1: turned round
    stuck_from_step: int | None = None  # the reading of that moment stays; None: never


@dataclass(frozen=True, slots=True)
class DriveLimits:
    """Limits a drive sets itself, besides max torque 0x6072; by default none that acts."""

    base_speed_rad_s: float = math.inf  # Field weakening begins here [rad/s]
    continuous_permille: float = math.inf  # Torque it can give for ever [per mille of rated]
    thermal_time_constant_s: float = 30.0  # Of winding and heat sink together [s]
    torque_step_permille: int = 1  # Coarseness of torque and current actual value [per mille]

    def weakening(self, speed_rad_s: float) -> float:
        """Field left at a speed, 0 to 1: torque per current, and largest torque, relative to standstill."""
        return min(1.0, self.base_speed_rad_s / max(abs(speed_rad_s), 1e-9))

    def quantised(self, permille: float) -> int:
        """Round a reading to the steps this drive tells it in."""
        return self.torque_step_permille * round(permille / self.torque_step_permille)


@dataclass(frozen=True, slots=True)
class InverterFaults:
    """What is wrong with a simulated inverter; by default nothing. What each does: docs/supported-protocols.md."""

    absent: bool = False  # it is not on the bus
    hang_at_step: int | None = None  # its program stops, link up: no torque, no answer
    reset_at_step: int | None = None  # it starts anew, as at power-on
    bus_off_at_step: int | None = None  # it leaves the bus; its torque goes as 0x6007 says
    stale_from_step: int | None = None  # each TPDO repeats the one before from there on
    stale_share: float = 0.0  # of its TPDOs that repeat the one before, at random, 0 to 1
    ignores_target_from_step: int | None = None  # no torque in OPERATION ENABLED, bit 12 of 0x6041 is 0
    leaves_operation: AtStep[PowerState] | None = None  # for this state, by itself, with neither fault nor EMCY
    wrong_torque: WrongTorque = field(default_factory=WrongTorque)  # by default it gives what it is asked for
    wrong_speed: WrongSpeed = field(default_factory=WrongSpeed)  # by default its resolver reads right
    second_tpdo: AtStep[int] | None = None  # somebody sends each TPDO again, with a speed of 0, at every n-th SYNC
    fault: AtStep[int] | None = None  # its error code, for EMCY and object 0x603F
    emcy: AtStep[int] | None = None  # the error code that it sends, without a fault
    brown_out_at_step: int | None = None  # its supply is gone: under-voltage 0x3220, not to be reset
    identity: tuple[int, int] | None = None  # vendor-ID and product code that 0x1018 reads; None: its own
    velocity_unit: int | None = None  # what 0x60A9 reads in place of its own; None: its own
    ignored_writes: frozenset[int] = frozenset()  # indices whose writes are acknowledged and forgotten
    missing_objects: frozenset[int] = frozenset()  # indices that it does not have, though its EDS does
    locked_objects: frozenset[int] = frozenset()  # indices that it refuses to write
    clock_drift_ppm: float = 0.0  # by which the clock it samples by is slow
    limits: DriveLimits = field(default_factory=DriveLimits)  # that it sets itself


@dataclass(frozen=True, slots=True)
class Frames:
    """Some of the frames of a bus, and by how much they are touched: a share, 0 to 1, or a time [s]."""

    amount: float  # whose meaning the fault gives
    cob_id: int | None = None  # None: all PDOs

    def meant(self, cob_id: int) -> bool:
        """Whether a frame is one of them; all PDOs are where no COB-ID is named."""
        return cob_id in PDO_COB_IDS if self.cob_id is None else cob_id == self.cob_id


@dataclass(frozen=True, slots=True)
class BusFaults:
    """What is wrong with the bus; by default nothing.

    A corrupt frame arrives one byte short, as from a faulty gateway: CAN's own CRC lets no wrong frame through. Delay
    and jitter are of the wall clock. Swapped nodes: each inverter has the node id of the other.
    """

    lose: AtStep[Frames] | None = None  # share that does not arrive
    corrupt: AtStep[Frames] | None = None  # share that arrives one byte short
    repeat: AtStep[Frames] | None = None  # share that arrives twice
    reorder: AtStep[Frames] | None = None  # share that the next one overtakes
    delay: AtStep[Frames] | None = None  # time by which they arrive later [s]
    jitter: AtStep[Frames] | None = None  # largest time by which they arrive later, in their order [s]
    off_at_step: int | None = None  # the host's controller leaves the bus: no frame either way
    swapped_nodes: bool = False  # from power-on

    @property
    def touch_frames(self) -> bool:
        """Whether a frame is ever treated in another way than on a good bus."""
        return replace(self, swapped_nodes=False) != BusFaults()


class PlcAnswers(Enum):
    """How a PLC answers a request: well, or in one of the ways in which a real one fails."""

    WELL = "well"
    NOT = "not"  # the connection stays
    EXCEPTION = "exception"
    LATE = "late"
    HALF = "half"
    RESET = "reset"
    TOO_FEW = "too few"  # one register less than was asked for
    WRONG_UNIT = "wrong unit"  # as a gateway does that mixes up its devices
    WRONG_TRANSACTION = "wrong transaction"


@dataclass(frozen=True, slots=True)
class PlcFaults:
    """What goes wrong, and when in simulated time [s]; nothing by default.

    ``answers_at_s`` has from when on the PLC answers in another way; of several the last one counts. With
    ``swaps_floats`` the words of its floating-point values have the other order than the register map says.
    """

    clutch_closes_at_s: float = math.inf  # it reports CLOSED from then on
    permissive_withdrawn_at_s: float = math.inf  # and not given again
    mode_changes_at_s: float = math.inf  # to ELECTRIC
    answers_at_s: frozenset[tuple[float, PlcAnswers]] = frozenset()
    swaps_floats: bool = False

    def answers(self, time_s: float) -> PlcAnswers:
        """Tell how the PLC answers at a simulated time [s]."""
        active = [each for each in self.answers_at_s if each[0] <= time_s]
        return max(active, key=itemgetter(0))[1] if active else PlcAnswers.WELL


@dataclass(frozen=True, slots=True)
class RigFaults:
    """What is wrong with the simulated devices; by default nothing."""

    m1: InverterFaults = field(default_factory=InverterFaults)  # of the drive behind inverter m1
    m2: InverterFaults = field(default_factory=InverterFaults)  # of the drive behind inverter m2
    bus: BusFaults = field(default_factory=BusFaults)  # between host and devices
    plc: PlcFaults = field(default_factory=PlcFaults)  # of the PLC and the vehicle it speaks for
