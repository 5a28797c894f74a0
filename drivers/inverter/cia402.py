"""The CiA 402 power state machine, torque modes, controlword and statusword. No bus, no clock.

Rule 1: every transition is in the tables of this file; host and simulated drive both use them.
Rule 2: a state is what the statusword says, never what was commanded.

The transition numbers in the comments are those of CiA 402-2, figure "Power drive system finite state
automaton". Transitions 0, 1 and 14 are the device's own; 13 happens on any fault.
"""

from __future__ import annotations

from enum import Enum, IntEnum, IntFlag

from drivers.errors import ProtocolViolation

_STATE_MASK = 0x6F
_QUICK_STOP_BIT = 0x20


class PowerState(Enum):
    """State of the power drive system; the value is its name in messages."""

    NOT_READY_TO_SWITCH_ON = "not ready to switch on"
    SWITCH_ON_DISABLED = "switch on disabled"
    READY_TO_SWITCH_ON = "ready to switch on"
    SWITCHED_ON = "switched on"
    OPERATION_ENABLED = "operation enabled"
    QUICK_STOP_ACTIVE = "quick stop active"
    FAULT_REACTION_ACTIVE = "fault reaction active"
    FAULT = "fault"

    __hash__ = object.__hash__  # members are single objects; an Enum's own hash is slow, and the cycle looks up by it


class Command(Enum):
    """A command of the controlword, 0x6040; the value is the word that gives it (bits 0 to 3 and 7)."""

    DISABLE_VOLTAGE = 0x0000
    QUICK_STOP = 0x0002
    SHUTDOWN = 0x0006
    SWITCH_ON = 0x0007  # in OPERATION_ENABLED the same word is called "disable operation"
    ENABLE_OPERATION = 0x000F
    FAULT_RESET = 0x0080  # a rising edge of bit 7

    __hash__ = object.__hash__  # as above


class TorqueMode(IntEnum):
    """Modes of operation, 0x6060, in which the drive follows a torque."""

    PROFILE_TORQUE = 4
    CYCLIC_SYNCHRONOUS_TORQUE = 10

    @property
    def title(self) -> str:
        """Number and name for messages, such as ``10 (cyclic synchronous torque)``."""
        return f"{self.value} ({self.name.lower().replace('_', ' ')})"

    @property
    def support_bit(self) -> int:
        """Mask of this mode in supported drive modes, 0x6502: bit ``mode - 1``."""
        return 1 << (self.value - 1)


class StatusBit(IntFlag):
    """Bits of the statusword, 0x6041, that are not part of the state."""

    VOLTAGE_ENABLED = 1 << 4
    WARNING = 1 << 7
    REMOTE = 1 << 9
    INTERNAL_LIMIT_ACTIVE = 1 << 11
    FOLLOWS_TARGET = 1 << 12  # in cyclic synchronous torque mode; 0: the target torque is ignored


_S, _C = PowerState, Command

TRANSITIONS: dict[PowerState, dict[Command, PowerState]] = {
    _S.NOT_READY_TO_SWITCH_ON: {},
    _S.SWITCH_ON_DISABLED: {_C.SHUTDOWN: _S.READY_TO_SWITCH_ON},  # 2
    _S.READY_TO_SWITCH_ON: {
        _C.SWITCH_ON: _S.SWITCHED_ON,  # 3
        _C.DISABLE_VOLTAGE: _S.SWITCH_ON_DISABLED,  # 7
        _C.QUICK_STOP: _S.SWITCH_ON_DISABLED,  # 7
    },
    _S.SWITCHED_ON: {
        _C.ENABLE_OPERATION: _S.OPERATION_ENABLED,  # 4
        _C.SHUTDOWN: _S.READY_TO_SWITCH_ON,  # 6
        _C.DISABLE_VOLTAGE: _S.SWITCH_ON_DISABLED,  # 10
        _C.QUICK_STOP: _S.SWITCH_ON_DISABLED,  # 10
    },
    _S.OPERATION_ENABLED: {
        _C.SWITCH_ON: _S.SWITCHED_ON,  # 5
        _C.SHUTDOWN: _S.READY_TO_SWITCH_ON,  # 8
        _C.DISABLE_VOLTAGE: _S.SWITCH_ON_DISABLED,  # 9
        _C.QUICK_STOP: _S.QUICK_STOP_ACTIVE,  # 11
    },
    _S.QUICK_STOP_ACTIVE: {
        _C.DISABLE_VOLTAGE: _S.SWITCH_ON_DISABLED,  # 12
        _C.ENABLE_OPERATION: _S.OPERATION_ENABLED,  # 16
    },
    _S.FAULT_REACTION_ACTIVE: {},
    _S.FAULT: {_C.FAULT_RESET: _S.SWITCH_ON_DISABLED},  # 15
}
"""What each command does in each state; a command that is not listed leaves the state as it is."""

AUTOMATIC: dict[PowerState, PowerState] = {
    _S.NOT_READY_TO_SWITCH_ON: _S.SWITCH_ON_DISABLED,  # 1
    _S.FAULT_REACTION_ACTIVE: _S.FAULT,  # 14
}
"""Transitions the drive makes by itself."""

TOWARDS_OPERATION: dict[PowerState, Command] = {
    _S.SWITCH_ON_DISABLED: _C.SHUTDOWN,
    _S.READY_TO_SWITCH_ON: _C.SWITCH_ON,
    _S.SWITCHED_ON: _C.ENABLE_OPERATION,
    _S.QUICK_STOP_ACTIVE: _C.DISABLE_VOLTAGE,
}
"""The command that leads one step nearer to OPERATION_ENABLED."""

TORQUE_STATES = frozenset({_S.OPERATION_ENABLED, _S.QUICK_STOP_ACTIVE, _S.FAULT_REACTION_ACTIVE})
"""States in which the power stage is on and the motor may carry torque."""

FAULT_STATES = frozenset({_S.FAULT_REACTION_ACTIVE, _S.FAULT})

STATUSWORD_STATE_BITS: dict[PowerState, int] = {
    _S.NOT_READY_TO_SWITCH_ON: 0x00,
    _S.SWITCH_ON_DISABLED: 0x40,
    _S.READY_TO_SWITCH_ON: 0x21,
    _S.SWITCHED_ON: 0x23,
    _S.OPERATION_ENABLED: 0x27,
    _S.QUICK_STOP_ACTIVE: 0x07,
    _S.FAULT_REACTION_ACTIVE: 0x0F,
    _S.FAULT: 0x08,
}
"""Bits 0 to 3, 5 and 6 of the statusword in each state (CiA 402-2, table "State coding")."""

_QUICK_STOP_COUNTS = frozenset({_S.READY_TO_SWITCH_ON, _S.SWITCHED_ON, _S.OPERATION_ENABLED, _S.QUICK_STOP_ACTIVE})


def _state_of_bits() -> dict[int, PowerState]:
    """Every coding of the six state bits; bit 5 is "don't care" in the states where it means nothing."""
    table = {}
    for state, bits in STATUSWORD_STATE_BITS.items():
        table[bits] = state
        if state not in _QUICK_STOP_COUNTS:
            table[bits | _QUICK_STOP_BIT] = state
    return table


_STATE_OF_BITS = _state_of_bits()


def state_of(statusword: int) -> PowerState:
    """Return the power state that a statusword 0x6041 shows (CiA 402); ProtocolViolation if its bits are no state."""
    state = _STATE_OF_BITS.get(statusword & _STATE_MASK)
    if state is None:
        raise ProtocolViolation(
            f"statusword 0x6041 is 0x{statusword:04X}: expected a CiA 402 state in bits 0-3, 5, 6, "
            f"got 0x{statusword & _STATE_MASK:02X}. Check that the EDS is the one of this drive."
        )
    return state


def command_of(controlword: int, previous: int = 0) -> Command:
    """Decode the command from a controlword, 0x6040, and the controlword before it.

    The lower bits rank as in CiA 402-2, table "Command coding"; fault reset counts on its rising edge alone.
    """
    if controlword & ~previous & Command.FAULT_RESET.value:
        return Command.FAULT_RESET
    if not controlword & 0x02:
        return Command.DISABLE_VOLTAGE
    if not controlword & 0x04:
        return Command.QUICK_STOP
    if not controlword & 0x01:
        return Command.SHUTDOWN
    return Command.ENABLE_OPERATION if controlword & 0x08 else Command.SWITCH_ON


def next_state(state: PowerState, command: Command) -> PowerState:
    """State after a command; the same state where the command has no effect there."""
    return TRANSITIONS[state].get(command, state)
