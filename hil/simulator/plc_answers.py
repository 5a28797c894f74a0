"""How the simulated PLC answers a request: well, or in one of the ways in which a real one fails."""

from __future__ import annotations

from enum import Enum
from typing import Final

LATE_BY_S: Final = 1.5
"""How late a slow PLC answers [s of the wall clock]: beyond the second that a client waits."""


class Answers(Enum):
    """How the PLC answers."""

    WELL = "well"
    NOT = "not"  # the connection stays
    EXCEPTION = "exception"
    LATE = "late"
    HALF = "half"
    RESET = "reset"
    TOO_FEW = "too few"  # one register less than was asked for
    WRONG_UNIT = "wrong unit"  # as a gateway does that mixes up its devices
    WRONG_TRANSACTION = "wrong transaction"
