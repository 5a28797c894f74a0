"""How many cycles a drive takes from a command to what it then reports: its dead time in a loop that is closed by PDO.

Measured without torque: the controlword that would come with one leads to READY TO SWITCH ON and back, where the power
stage is off. 0 is a drive whose answer to a SYNC shows what that very SYNC put into effect. A state machine may be
slower than a current loop, so this is the most that a torque may take, a lag of the current itself aside.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from drivers.inverter.cia402 import Command, PowerState

STEPS: Final = (
    (Command.DISABLE_VOLTAGE, PowerState.SWITCH_ON_DISABLED),
    (Command.SHUTDOWN, PowerState.READY_TO_SWITCH_ON),
)
ROUNDS: Final = 5

MOST_CYCLES: Final = 20
"""A drive that takes longer waits for something else, as for its mains contactor: nothing is measured then."""

Exchange = Callable[[Command], PowerState | None]
"""Sends a command and SYNC, waits for the rest of the cycle; gives the state in the answer, None without one."""


def dead_cycles(exchange: Exchange) -> int | None:
    """Count the cycles from a command to the answer that shows it, the most of all rounds; None beyond `MOST_CYCLES`.

    Begins and ends in READY TO SWITCH ON.
    """
    most = 0
    for command, state in ROUNDS * STEPS:
        for cycles in range(MOST_CYCLES + 1):
            if exchange(command) is state:
                most = max(most, cycles)
                break
        else:
            return None
    return most
