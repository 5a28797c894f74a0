"""The state machine: every pair of state and command against CiA 402-2, every statusword."""

import itertools

import pytest

from drivers.errors import ProtocolViolation
from drivers.inverter.cia402 import (
    AUTOMATIC,
    FAULT_STATES,
    STATUSWORD_STATE_BITS,
    TORQUE_STATES,
    TOWARDS_OPERATION,
    Command,
    PowerState,
    StatusBit,
    TorqueMode,
    command_of,
    next_state,
    state_of,
)

S, C = PowerState, Command

# Figure "Power drive system finite state automaton" of CiA 402-2, arrow by arrow: not taken from the table.
ARROWS = {
    (S.SWITCH_ON_DISABLED, C.SHUTDOWN): S.READY_TO_SWITCH_ON,
    (S.READY_TO_SWITCH_ON, C.SWITCH_ON): S.SWITCHED_ON,
    (S.SWITCHED_ON, C.ENABLE_OPERATION): S.OPERATION_ENABLED,
    (S.OPERATION_ENABLED, C.SWITCH_ON): S.SWITCHED_ON,
    (S.SWITCHED_ON, C.SHUTDOWN): S.READY_TO_SWITCH_ON,
    (S.READY_TO_SWITCH_ON, C.DISABLE_VOLTAGE): S.SWITCH_ON_DISABLED,
    (S.READY_TO_SWITCH_ON, C.QUICK_STOP): S.SWITCH_ON_DISABLED,
    (S.OPERATION_ENABLED, C.SHUTDOWN): S.READY_TO_SWITCH_ON,
    (S.OPERATION_ENABLED, C.DISABLE_VOLTAGE): S.SWITCH_ON_DISABLED,
    (S.SWITCHED_ON, C.DISABLE_VOLTAGE): S.SWITCH_ON_DISABLED,
    (S.SWITCHED_ON, C.QUICK_STOP): S.SWITCH_ON_DISABLED,
    (S.OPERATION_ENABLED, C.QUICK_STOP): S.QUICK_STOP_ACTIVE,
    (S.QUICK_STOP_ACTIVE, C.DISABLE_VOLTAGE): S.SWITCH_ON_DISABLED,
    (S.FAULT, C.FAULT_RESET): S.SWITCH_ON_DISABLED,
    (S.QUICK_STOP_ACTIVE, C.ENABLE_OPERATION): S.OPERATION_ENABLED,
}


@pytest.mark.parametrize(("state", "command"), [*itertools.product(PowerState, Command)])
def test_every_command_in_every_state(state: PowerState, command: Command) -> None:
    assert next_state(state, command) is ARROWS.get((state, command), state)


@pytest.mark.parametrize("state", PowerState)
def test_towards_operation_reaches_it_from_every_state_but_fault(state: PowerState) -> None:
    for _ in PowerState:
        if state in AUTOMATIC:
            state = AUTOMATIC[state]
        elif state in TOWARDS_OPERATION:
            after = next_state(state, TOWARDS_OPERATION[state])
            assert after is not state
            state = after
    assert state in (S.OPERATION_ENABLED, S.FAULT)


def test_disable_voltage_leads_out_of_every_torque_state_but_the_fault_reaction() -> None:
    for state in TORQUE_STATES - FAULT_STATES:
        assert next_state(state, C.DISABLE_VOLTAGE) is S.SWITCH_ON_DISABLED


@pytest.mark.parametrize("statusword", range(0x80))
def test_every_statusword_is_one_state_or_refused(statusword: int) -> None:
    # Table "State coding" of CiA 402-2 as masks and values: bit 5 counts in four states only.
    coding = {
        S.NOT_READY_TO_SWITCH_ON: (0x4F, 0x00),
        S.SWITCH_ON_DISABLED: (0x4F, 0x40),
        S.READY_TO_SWITCH_ON: (0x6F, 0x21),
        S.SWITCHED_ON: (0x6F, 0x23),
        S.OPERATION_ENABLED: (0x6F, 0x27),
        S.QUICK_STOP_ACTIVE: (0x6F, 0x07),
        S.FAULT_REACTION_ACTIVE: (0x4F, 0x0F),
        S.FAULT: (0x4F, 0x08),
    }
    matching = [state for state, (mask, value) in coding.items() if statusword & mask == value]
    if matching:
        assert [state_of(statusword)] == matching
    else:
        with pytest.raises(ProtocolViolation, match=f"0x{statusword:04X}.*Check that the EDS"):
            state_of(statusword)


@pytest.mark.parametrize("state", PowerState)
def test_other_bits_do_not_change_the_state(state: PowerState) -> None:
    assert state_of(STATUSWORD_STATE_BITS[state] | 0xFF90) is state


@pytest.mark.parametrize("controlword", range(0x100))
def test_every_controlword_is_the_command_of_the_standard(controlword: int) -> None:
    # Table "Command coding" of CiA 402-2 as patterns of bits 7 and 3 to 0; x is any.
    patterns = {
        C.FAULT_RESET: "1xxxx",
        C.SHUTDOWN: "0x110",
        C.SWITCH_ON: "00111",
        C.ENABLE_OPERATION: "01111",
        C.DISABLE_VOLTAGE: "0xx0x",
        C.QUICK_STOP: "0x01x",
    }
    bits = f"{controlword >> 7 & 1:b}{controlword & 0xF:04b}"
    matching = [
        command
        for command, pattern in patterns.items()
        if all(expected in ("x", bit) for expected, bit in zip(pattern, bits, strict=True))
    ]
    assert [command_of(controlword)] == matching


def test_fault_reset_counts_on_its_rising_edge_alone() -> None:
    assert command_of(0x0080, previous=0x0080) is C.DISABLE_VOLTAGE
    assert command_of(0x0080, previous=0x000F) is C.FAULT_RESET


@pytest.mark.parametrize("command", Command)
def test_every_command_survives_its_controlword(command: Command) -> None:
    assert command_of(command.value) is command


def test_modes_name_themselves_and_their_support_bit() -> None:
    assert TorqueMode(10).title == "10 (cyclic synchronous torque)"
    assert (TorqueMode.PROFILE_TORQUE.support_bit, TorqueMode(10).support_bit) == (1 << 3, 1 << 9)


def test_bits_of_the_statusword_next_to_the_state_are_those_of_the_standard() -> None:
    """CiA 402-2, object 6041h; bit 12 as in cyclic synchronous torque mode."""
    assert {bit.name: bit.value for bit in StatusBit} == {
        "VOLTAGE_ENABLED": 0x0010,
        "WARNING": 0x0080,
        "REMOTE": 0x0200,
        "INTERNAL_LIMIT_ACTIVE": 0x0800,
        "FOLLOWS_TARGET": 0x1000,
    }


def test_words_of_the_commands_are_those_of_the_standard() -> None:
    """CiA 402-2, table "Command coding", don't-care bits 0 but for those that every state allows to be 1."""
    assert {command.name: command.value for command in Command} == {
        "DISABLE_VOLTAGE": 0x0000,
        "QUICK_STOP": 0x0002,
        "SHUTDOWN": 0x0006,
        "SWITCH_ON": 0x0007,
        "ENABLE_OPERATION": 0x000F,
        "FAULT_RESET": 0x0080,
    }


def test_a_controlword_without_one_before_it_may_be_a_reset() -> None:
    assert command_of(0x0080) is Command.FAULT_RESET


def test_a_code_of_no_state_is_reported_by_its_own_bits() -> None:
    with pytest.raises(ProtocolViolation, match=r"0x6041 is 0xFF10: .* got 0x00\.|0x6041 is 0xFF2A: .* got 0x2A\."):
        state_of(0xFF2A)
