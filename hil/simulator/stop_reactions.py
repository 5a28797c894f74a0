"""How a simulated drive stops by itself: option code to ramp and end (CiA 402-2, 0x6007 and 0x605A to 0x605E).

::

    605A quick stop          0 at once   1 slope   2 quick   3, 4 at once   5 to 8 the same, and stay
    605B shutdown            0 at once   1 slope
    605C disable operation   0 at once   1 slope
    605D halt                            1 slope   2 quick   3, 4 at once
    605E fault reaction      0 at once   1 slope   2 quick   3, 4 at once
    6007 abort connection    0 nothing   1 fault   2 disable voltage   3 quick stop

"Slope" is the torque slope, 0x6087; "quick" a steeper one of the drive's own. Where the standard brakes on the
current or voltage limit, this drive has no torque at once. It refuses codes of a maker's own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, IntEnum
from types import MappingProxyType
from typing import Final

from drivers.inverter.cia402 import AUTOMATIC, PowerState


class Ramp(Enum):
    """How the torque goes to zero."""

    AT_ONCE = "at once"
    SLOPE = "by the torque slope 0x6087"
    QUICK = "by the drive's own quick slope"


class AbortConnection(IntEnum):
    """Abort connection option code, 0x6007."""

    NO_ACTION = 0
    FAULT = 1
    DISABLE_VOLTAGE = 2
    QUICK_STOP = 3


@dataclass(frozen=True, slots=True)
class Stop:
    """A stop under way: the ramp, the power state while it lasts, and that at its end."""

    ramp: Ramp
    passing: PowerState
    final: PowerState


_S = PowerState

_SLOPES: Final = MappingProxyType({1: Ramp.SLOPE, 2: Ramp.QUICK})

KNOWN_CODES: Final[Mapping[int, frozenset[int]]] = MappingProxyType(
    {
        0x6007: frozenset(AbortConnection),
        0x605A: frozenset(range(9)),
        0x605B: frozenset({0, 1}),
        0x605C: frozenset({0, 1}),
        0x605D: frozenset(range(1, 5)),
        0x605E: frozenset(range(5)),
    }
)
"""The codes this drive knows of each object; it refuses others."""

STANDARD_CODES: Final[Mapping[int, int]] = MappingProxyType(
    {0x6007: 1, 0x605A: 2, 0x605B: 0, 0x605C: 1, 0x605D: 1, 0x605E: 2}
)
"""CiA 402-2's own default values, for a drive whose EDS lists no such object."""

_STAYING: Final = 4
"""Quick stop codes from 5 on are those from 1 on, but the drive stays in QUICK STOP ACTIVE."""


def stop_between(state: PowerState, target: PowerState, codes: Mapping[int, int]) -> Stop:
    """Choose how a drive goes from a state to another.

    Parameters
    ----------
    state, target
        Where it is, and where the state machine has it go.
    codes
        Option code by object.
    """
    if state is _S.OPERATION_ENABLED:
        if target is _S.READY_TO_SWITCH_ON:
            return Stop(_ramp(codes[0x605B]), state, target)
        if target is _S.SWITCHED_ON:
            return Stop(_ramp(codes[0x605C]), state, target)
        if target is _S.QUICK_STOP_ACTIVE:
            return _quick_stop(codes[0x605A])
    if target is _S.FAULT_REACTION_ACTIVE:
        return Stop(_ramp(codes[0x605E]), target, AUTOMATIC[target])
    return Stop(Ramp.AT_ONCE, target, target)


def halt_ramp(codes: Mapping[int, int]) -> Ramp:
    """Choose how the torque goes to zero while halt, bit 8 of the controlword, is set."""
    return _ramp(codes[0x605D])


def _quick_stop(code: int) -> Stop:
    if code == 0:
        return Stop(Ramp.AT_ONCE, _S.SWITCH_ON_DISABLED, _S.SWITCH_ON_DISABLED)
    stays = code > _STAYING
    ramp = _ramp(code - _STAYING if stays else code)
    return Stop(ramp, _S.QUICK_STOP_ACTIVE, _S.QUICK_STOP_ACTIVE if stays else _S.SWITCH_ON_DISABLED)


def _ramp(code: int) -> Ramp:
    return _SLOPES.get(code, Ramp.AT_ONCE)
