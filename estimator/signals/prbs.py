"""Maximum-length pseudo-random binary sequence (PRBS) from a feedback shift register.

The paper superposes the sequence of a ten-cell register on the torque reference. A register of n cells with
the feedback of a primitive polynomial runs through all 2^n - 1 non-zero states, so that one period has
"""

from __future__ import annotations

from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from estimator.signals.settings import Requirement, is_positive, require

TAPS = MappingProxyType(
    {
        2: (2, 1),
        3: (3, 2),
        4: (4, 3),
        5: (5, 3),
        6: (6, 5),
        7: (7, 6),
        8: (8, 6, 5, 4),
        9: (9, 5),
        10: (10, 7),
        11: (11, 9),
        12: (12, 6, 4, 1),
        13: (13, 4, 3, 1),
        14: (14, 5, 3, 1),
        15: (15, 14),
        16: (16, 15, 13, 4),
    }
)
"""Tapped cells for each register length.

Source: P. Alfke, "Efficient Shift Registers, LFSR Counters, and Long Pseudo-Random Sequence Generators",
Xilinx application note XAPP 052 (1996). The tests run every one of them through its whole period.
"""


def shift(state: int, cells: int) -> int:
    """Clock a register of ``cells`` cells once and return its next state."""
    feedback = 0
    for cell in TAPS[cells]:
        feedback ^= state >> (cell - 1)
    return ((state << 1) | (feedback & 1)) & ((1 << cells) - 1)


class Prbs:
    """The sequence, one level per cycle."""

    __slots__ = ("_cells", "_clock_divider", "_held", "_level_nm", "_state")

    def __init__(self, amplitude_nm: float, cells: int = 10, clock_divider: int = 1, seed: int = 1) -> None:
        longest, shortest = max(TAPS), min(TAPS)
        largest_seed = (1 << min(max(cells, shortest), longest)) - 1
        require(
            "PRBS",
            (
                Requirement("amplitude_nm", amplitude_nm, is_positive(amplitude_nm), "a torque above 0 Nm"),
                Requirement("cells", cells, cells in TAPS, f"a register length from {shortest} to {longest}"),
                Requirement("clock_divider", clock_divider, clock_divider >= 1, "1 or more cycles per level"),
                Requirement("seed", seed, 1 <= seed <= largest_seed, f"a state from 1 to {largest_seed}"),
            ),
        )
        self._level_nm = amplitude_nm
        self._cells = cells
        self._clock_divider = clock_divider
        self._state = seed
        self._held = 0

    @property
    def state(self) -> int:
        """State of the register; the most significant of its cells is the present level."""
        return self._state

    def next(self) -> float:
        """Return the level of this cycle [Nm] and continue to the next cycle."""
        level_nm = self._level_nm if self._state >> (self._cells - 1) else -self._level_nm
        self._held += 1
        if self._held == self._clock_divider:
            self._held = 0
            self._state = shift(self._state, self._cells)
        return level_nm


def prbs_nm(
    n_samples: int, amplitude_nm: float, cells: int = 10, clock_divider: int = 1, seed: int = 1
) -> NDArray[np.float64]:
    """Return the first ``n_samples`` levels of :class:`Prbs` as an array of shape (n_samples,) [Nm]."""
    source = Prbs(amplitude_nm, cells, clock_divider, seed)
    return np.fromiter((source.next() for _ in range(n_samples)), dtype=np.float64, count=n_samples)
