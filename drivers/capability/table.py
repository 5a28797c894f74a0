"""The capability table: each function, its objects in order of preference, what is done without, what that costs.

First how it is written, then the table. Data types are those of CiA 301 and CiA 402-2. Where a second type stands,
drives have it and its values mean the same. Everything that depends on what a drive has asks here: the check of an EDS,
what a drive is given when it is configured, its PDOs, and the simulated drives.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType
from typing import Final

from drivers.scaling import IntegerType

_I8, _I16, _I32 = IntegerType.INTEGER8, IntegerType.INTEGER16, IntegerType.INTEGER32
_U8, _U16, _U32 = IntegerType.UNSIGNED8, IntegerType.UNSIGNED16, IntegerType.UNSIGNED32

SYNC_COB_ID: Final = 0x080  # identifier of the host's SYNC
EVENT_TIMER: Final = 5  # sub-index of a PDO's communication parameter; of an RPDO it is the deadline [ms]

NEVER_WITHOUT: Final = "the drive can't be used"

_OWN_REACTION: Final = "the drive does what its maker has set"


class Function(Enum):
    """What this program wants of a drive; the value is its name for people."""

    CONTROLWORD = "controlword"
    STATUSWORD = "statusword"
    MODE = "modes of operation"
    MODE_DISPLAY = "modes of operation display"
    SUPPORTED_MODES = "supported drive modes"
    TORQUE_TARGET = "target torque"
    TORQUE_OFFSET = "torque offset"
    TORQUE_ACTUAL = "torque actual value"
    SPEED_ACTUAL = "velocity actual value"
    SPEED_UNIT = "unit of speed"
    RATED_TORQUE = "motor rated torque"
    MAXIMUM_TORQUE = "max torque"
    TORQUE_SLOPE = "torque slope"
    ERROR_CODE = "error code"
    VENDOR = "vendor-ID"
    PRODUCT = "product code"
    HEARTBEAT_PRODUCER = "producer heartbeat time"
    HEARTBEAT_CONSUMER = "consumer heartbeat time"
    RPDO_DEADLINE = "RPDO deadline"
    ABORT_CONNECTION = "abort connection option code"
    QUICK_STOP_CODE = "quick stop option code"
    SHUTDOWN_CODE = "shutdown option code"
    DISABLE_CODE = "disable operation option code"
    HALT_CODE = "halt option code"
    FAULT_CODE = "fault reaction option code"
    SYNC_ID = "COB-ID SYNC"
    EMCY_ID = "COB-ID EMCY"

    __hash__ = object.__hash__  # members are single objects


class Without(Enum):
    """What becomes of a drive that does not have a function."""

    REFUSED = "refused"
    """It can't be used."""

    RIG_FILE = "rig file"
    """A key of the rig file has to say it."""

    ACCEPTED = "accepted"
    """Somebody has to accept it, by name and with a reason, in the rig file."""

    DONE = "done without"
    """This program does it another way, or does without."""


@dataclass(frozen=True, slots=True)
class Part:
    """One value of the object dictionary that takes part in giving a function."""

    index: int  # of the object
    subindex: int  # of the value in it
    kinds: tuple[IntegerType, ...]  # data types it may have
    written: bool = False  # whether it is written
    read_back: bool = False  # whether what is written is read back
    held: range | None = None  # values it may hold for good where it can't be written


@dataclass(frozen=True, slots=True)
class Capability:
    """One row of the table."""

    function: Function  # what is wanted
    ways: tuple[tuple[Part, ...], ...]  # objects that give it, in order of preference
    without: Without  # what becomes of a drive that has none of them
    instead: str  # what is done then, in words
    cost: str = ""  # what that costs, in words
    key: str = ""  # key of the rig file that says it or by which it is accepted


_F, _W = Function, Without


def _one(
    index: int, *kinds: IntegerType, subindex: int = 0, written: bool = False, read_back: bool = False
) -> tuple[tuple[Part, ...], ...]:
    """Write a single way of a single part."""
    return ((Part(index, subindex, kinds, written, read_back),),)


_ROWS: Final = (
    Capability(_F.CONTROLWORD, _one(0x6040, _U16, written=True), _W.REFUSED, NEVER_WITHOUT),
    Capability(_F.STATUSWORD, _one(0x6041, _U16), _W.REFUSED, NEVER_WITHOUT),
    Capability(_F.MODE, _one(0x6060, _I8, written=True), _W.REFUSED, NEVER_WITHOUT),
    Capability(_F.MODE_DISPLAY, _one(0x6061, _I8), _W.REFUSED, NEVER_WITHOUT),
    Capability(
        _F.SUPPORTED_MODES,
        _one(0x6502, _U32),
        _W.DONE,
        "the mode display 0x6061 alone confirms the mode",
        "a mode the drive does not have is found when it is armed",
    ),
    Capability(_F.TORQUE_TARGET, _one(0x6071, _I16, written=True), _W.REFUSED, NEVER_WITHOUT),
    Capability(
        _F.TORQUE_OFFSET,
        _one(0x60B2, _I16, written=True),
        _W.DONE,
        "base torque and PRBS are summed into 0x6071; the host keeps them apart, also in the recording",
        "the drive's own trace and a bus trace show the sum; in profile torque mode the slope acts on the PRBS too",
    ),
    Capability(_F.TORQUE_ACTUAL, _one(0x6077, _I16), _W.REFUSED, NEVER_WITHOUT),
    Capability(_F.SPEED_ACTUAL, _one(0x606C, _I32), _W.REFUSED, NEVER_WITHOUT),
    Capability(
        _F.SPEED_UNIT,
        (
            (Part(0x60A9, 0, (_U32,)),),
            (Part(0x608B, 0, (_I8,)), Part(0x608C, 0, (_U8,))),  # notation and dimension index, CiA 402 version 2
        ),
        _W.RIG_FILE,
        "the rig file says the unit of 0x606C",
        "nothing compares it with the drive: take it from the manual",
        key="speed_unit",
    ),
    Capability(
        _F.RATED_TORQUE,
        _one(0x6076, _U32),
        _W.RIG_FILE,
        "the rig file's rated_torque_nm scales the torque",
        "nothing compares it with the drive: take it from the manual",
        key="rated_torque_nm",
    ),
    Capability(
        _F.MAXIMUM_TORQUE,
        (
            (Part(0x6072, 0, (_U16, _I16)),),
            (Part(0x60E0, 0, (_U16, _I16)), Part(0x60E1, 0, (_U16, _I16))),  # positive and negative torque limit
        ),
        _W.RIG_FILE,
        "the rig file's torque_limit_nm alone limits the torque",
        "a limit of the drive's own is seen in its feedback only",
        key="torque_limit_nm",
    ),
    Capability(
        _F.TORQUE_SLOPE, _one(0x6087, _U32, _I32, written=True, read_back=True), _W.DONE, "the drive's own slope acts"
    ),
    Capability(
        _F.ERROR_CODE,
        _one(0x603F, _U16),
        _W.DONE,
        "the error code of the last EMCY counts",
        "the cause of a fault from before this program began is not known",
    ),
    Capability(_F.VENDOR, _one(0x1018, _U32, subindex=1), _W.REFUSED, NEVER_WITHOUT),
    Capability(
        _F.PRODUCT,
        _one(0x1018, _U32, subindex=2),
        _W.DONE,
        "the product is not compared",
        "another model is not noticed",
    ),
    Capability(
        _F.HEARTBEAT_PRODUCER,
        ((Part(0x1017, 0, (_U16,), written=True, read_back=True, held=range(1, 0x10000)),),),
        _W.REFUSED,
        NEVER_WITHOUT,
    ),
    Capability(
        _F.HEARTBEAT_CONSUMER,
        _one(0x1016, _U32, subindex=1, written=True, read_back=True),
        _W.ACCEPTED,
        "the drive does not notice that host, computer or cable is gone",
        "whatever else stops it then has to be known",
        key="heartbeat_consumer",
    ),
    Capability(
        _F.RPDO_DEADLINE,
        (),  # the PDO that carries the command decides: its sub-index 5
        _W.ACCEPTED,
        "the drive does not notice a host whose cycle hangs and whose heart beats",
        "whatever else stops it then has to be known",
        key="rpdo_deadline",
    ),
    Capability(
        _F.ABORT_CONNECTION,
        _one(0x6007, _I16),
        _W.ACCEPTED,
        "what the drive does when the host fails is not known from its data sheet",
        "whatever else stops it then has to be known",
        key="abort_connection",
    ),
    Capability(_F.QUICK_STOP_CODE, _one(0x605A, _I16), _W.DONE, _OWN_REACTION),
    Capability(_F.SHUTDOWN_CODE, _one(0x605B, _I16), _W.DONE, _OWN_REACTION),
    Capability(_F.DISABLE_CODE, _one(0x605C, _I16), _W.DONE, _OWN_REACTION),
    Capability(_F.HALT_CODE, _one(0x605D, _I16), _W.DONE, _OWN_REACTION),
    Capability(_F.FAULT_CODE, _one(0x605E, _I16), _W.DONE, _OWN_REACTION),
    Capability(
        _F.SYNC_ID,
        ((Part(0x1005, 0, (_U32,), written=True, read_back=True, held=range(SYNC_COB_ID, SYNC_COB_ID + 1)),),),
        _W.DONE,
        f"SYNC has the identifier CiA 301 gives it, 0x{SYNC_COB_ID:03X}",
    ),
    Capability(
        _F.EMCY_ID, _one(0x1014, _U32), _W.DONE, "EMCY has the identifier CiA 301 gives it, 0x080 and the node id"
    ),
)

TABLE: Final[Mapping[Function, Capability]] = MappingProxyType({row.function: row for row in _ROWS})

OPTION_CODES: Final[Mapping[int, Function]] = MappingProxyType(
    {
        TABLE[function].ways[0][0].index: function
        for function in (
            _F.ABORT_CONNECTION,
            _F.QUICK_STOP_CODE,
            _F.SHUTDOWN_CODE,
            _F.DISABLE_CODE,
            _F.HALT_CODE,
            _F.FAULT_CODE,
        )
    }
)
"""What the drive does by itself when something ends (CiA 402-2), by object."""
