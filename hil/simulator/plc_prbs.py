"""The PRBS generator inside the simulated PLC: code of its own on purpose, as a real PLC has.

A ten-cell shift register whose first cell takes the exclusive or of cells 10 and 7: x^10 + x^7 + 1 is
primitive, so that it runs through all 1023 states.
"""

from __future__ import annotations

from typing import Final

CELLS: Final = 10
TAPS: Final = (10, 7)


class PlcPrbs:
    """The generator, clocked by the PLC's cycle.

    Parameters
    ----------
    amplitude_nm : float
        The level is plus or minus this torque [Nm].
    divider : int
        PLC cycles each level is held.
    seed : int
        First state, 1 to 1023.
    """

    __slots__ = ("_amplitude_nm", "_divider", "_held", "_state")

    def __init__(self, amplitude_nm: float, divider: int, seed: int) -> None:
        self._amplitude_nm = amplitude_nm
        self._divider = divider
        self._state = seed
        self._held = 0

    @property
    def torque_nm(self) -> float:
        """Level of this cycle [Nm]; its sign is that of the last cell."""
        return self._amplitude_nm if self._state >> (CELLS - 1) else -self._amplitude_nm

    def clock(self) -> None:
        """Let one PLC cycle pass."""
        self._held += 1
        if self._held >= self._divider:
            feedback = sum(self._state >> (cell - 1) for cell in TAPS) & 1
            self._state = ((self._state << 1) | feedback) & (2**CELLS - 1)
            self._held = 0
