"""The last rows of a table that grows without end."""

from __future__ import annotations

import numpy as np

from estimator.signals.record import FloatArray


class Ring:
    """Keeps the last ``length`` rows of ``columns`` numbers."""

    def __init__(self, length: int, columns: int) -> None:
        self._rows = np.empty((2 * length, columns))
        self._length = length
        self._end = 0

    def append(self, row: tuple[float, ...]) -> None:
        """Add one row."""
        if self._end == self._rows.shape[0]:  # move the younger half to the front: once in ``length`` rows
            self._rows[: self._length] = self._rows[self._length :]
            self._end = self._length
        self._rows[self._end] = row
        self._end += 1

    def rows(self) -> FloatArray:
        """Copy what is kept, shape (n, columns), oldest first."""
        return self._rows[max(0, self._end - self._length) : self._end].copy()

    def clear(self) -> None:
        """Forget everything."""
        self._end = 0
