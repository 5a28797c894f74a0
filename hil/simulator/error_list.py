"""The errors of a simulated drive: those active, the register 0x1001 they make, the field 0x1003, EMCY messages."""

from __future__ import annotations

from collections import deque
from typing import Final

from drivers.canopen.emcy import Emergency

GENERIC: Final = 0x01
_CLASSES: Final = {0x2000: 0x02, 0x3000: 0x04, 0x4000: 0x08, 0x8100: 0x10, 0x8200: 0x10, 0x5000: 0x20, 0x6000: 0x20}
"""Bits of the error register besides the generic one, by class of error code (CiA 301, 7.5.2.2): current, voltage,
temperature, communication, device profile."""

_HISTORY: Final = 4
"""Entries of the pre-defined error field."""

_NO_DATA: Final = bytes(5)


class ErrorList:
    """What is wrong with one drive now, and what was."""

    __slots__ = ("_active", "_due", "_history")

    def __init__(self) -> None:
        self._active: set[int] = set()
        self._due: list[Emergency] = []
        self._history: deque[int] = deque(maxlen=_HISTORY)

    @property
    def register(self) -> int:
        """Error register, 0x1001."""
        bits = 0
        for code in self._active:
            bits |= GENERIC | _CLASSES.get(code & 0xFF00, _CLASSES.get(code & 0xF000, 0))
        return bits

    def set(self, code: int) -> None:
        """Take an error; one that is there already is not reported again."""
        if code not in self._active:
            self._active.add(code)
            self._history.appendleft(code)
            self._due.append(Emergency(code, self.register, _NO_DATA))

    def clear(self, *codes: int) -> None:
        """Take errors for gone, all of them if none is named; the last one's end is reported."""
        before = bool(self._active)
        self._active = self._active.difference(codes) if codes else set()
        if before and not self._active:
            self._due.append(Emergency(0, 0, _NO_DATA))

    def history(self, subindex: int) -> int:
        """Read the pre-defined error field, 0x1003: how many, then the newest first."""
        if subindex == 0:
            return len(self._history)
        return self._history[subindex - 1] if subindex <= len(self._history) else 0

    def forget_history(self) -> None:
        """Empty the pre-defined error field."""
        self._history.clear()

    def take_due(self) -> list[Emergency]:
        """Hand over the EMCY messages not sent yet."""
        due, self._due = self._due, []
        return due
