"""How the capability table is written: a function, the ways to have it, and what stands in without one."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from drivers.scaling import IntegerType


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
    """One value of the object dictionary that takes part in giving a function.

    Attributes
    ----------
    index, subindex
        The object.
    kinds
        Data types it may have: one of another type says something else, or by another scale.
    written
        Whether it is written; else it is read.
    read_back
        Whether what is written is read back.
    carried
        Whether a PDO has to carry it: an RPDO what is written, a TPDO what is read.
    held
        Values it may hold for good where it can't be written; None for none.
    """

    index: int
    subindex: int
    kinds: tuple[IntegerType, ...]
    written: bool = False
    read_back: bool = False
    carried: bool = False
    held: range | None = None


@dataclass(frozen=True, slots=True)
class Capability:
    """One row of the table.

    Attributes
    ----------
    function
        What is wanted.
    ways
        Objects that give it, in order of preference; a way has one part or more.
    without
        What becomes of a drive that has none of them.
    instead
        What is done then, in words.
    cost
        What that costs, in words.
    key
        Key of the rig file that says it or by which it is accepted; empty without one.
    """

    function: Function
    ways: tuple[tuple[Part, ...], ...]
    without: Without
    instead: str
    cost: str = ""
    key: str = ""
