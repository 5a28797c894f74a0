"""How often a drive sends its feedback: once per SYNC, neither twice nor every third time.

Twice is another producer of SYNC, or a drive that sends by a timer of its own; seldom is a bus with no room, or a drive
set to answer every n-th SYNC. That none comes at all is noticed sooner, by the age of the feedback.
"""

from __future__ import annotations

from collections import deque
from typing import Final

from drivers.errors import DeviceFault

CYCLES: Final = 50
"""Cycles that are looked at together: half a second at 10 ms."""

LEAST: Final = 0.5
MOST: Final = 1.5
"""Messages per cycle."""


class MessageRate:
    """Counts one drive's feedback over the last `CYCLES` cycles.

    Parameters
    ----------
    where
        Device, for messages.
    """

    __slots__ = ("_counts", "_where")

    def __init__(self, where: str) -> None:
        self._where = where
        self._counts: deque[int] = deque(maxlen=CYCLES + 1)

    def take(self, count: int) -> None:
        """Take how many messages have come since counting began, once per cycle.

        Raises
        ------
        DeviceFault
            If they come more often, or more seldom, than the cycles allow.
        """
        self._counts.append(count)
        if len(self._counts) <= CYCLES:
            return
        per_cycle = (self._counts[-1] - self._counts[0]) / CYCLES
        if not LEAST <= per_cycle <= MOST:
            raise DeviceFault(
                f"{self._where}: {per_cycle:g} TPDOs per SYNC in the last {CYCLES} cycles, expected one. Look for "
                "another producer of SYNC, the transmission type of its TPDO, and a bus without room; a simulated one "
                "answers late on a busy machine."
            )
