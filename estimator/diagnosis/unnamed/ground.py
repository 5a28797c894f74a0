"""What re-tuning could explain of a fit's error, to be taken out before laws are held against it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimator.diagnosis.line import Line, block_mean_of
from estimator.diagnosis.unnamed.scene import Scene
from estimator.physics.jacobian import jacobian_at
from estimator.signals.record import BoolArray, FloatArray


class Ground:
    """What the free unknowns of a fit could explain, to first order; rows are the blocks in use of all recordings.

    Attributes
    ----------
    raw, error : ndarray, shape (rows,)
        The error, and what re-tuning would leave of it.
    jacobian : ndarray, shape (rows, U)
        Derivative of the output by every unknown.
    basis : ndarray, shape (rows, F)
        Orthonormal basis of what the free unknowns move.
    """

    def __init__(self, cut: Sequence[Line], jacobian: FloatArray, error: FloatArray, pinned: BoolArray) -> None:
        self.jacobian, self.raw, self.unknowns = jacobian, error, jacobian.shape[1]
        self.basis = np.linalg.qr(jacobian[:, ~pinned])[0]
        self._sizes = np.cumsum([int(line.rows.sum()) for line in cut])[:-1]
        self.error = self.rest(error)

    def rest(self, signals: FloatArray) -> FloatArray:
        """Return what is left of signals, shape (rows,) or (rows, q)."""
        left: FloatArray = signals - self.basis @ (self.basis.T @ signals)
        return left

    def split(self, rows: FloatArray) -> list[FloatArray]:
        """Split rows into one array per recording."""
        return list(np.split(rows, self._sizes))


def ground_of(view: Scene) -> Ground:
    """Return what re-tuning a fit further could explain of its error.

    The derivative is found anew: that of a fit is of the place before its last step. That is near enough for all but
    this. Of a drifting position re-tuning explains nearly all that a law does, and the rest is in the fifth digit.
    """
    result = view.result
    jacobian = jacobian_at(result.problem, result.x, result.outputs)
    row, parts = 0, []
    for i, (line, use) in enumerate(zip(view.cut, result.problem.use, strict=True)):
        count, full = int(use.sum()), np.zeros(use.size)
        part = np.empty((line.size, result.x.size))
        for j in range(result.x.size):
            full[use] = jacobian[row : row + count, j]
            part[:, j] = block_mean_of(full, use, line.length)[0]
        row += count
        parts.append(view.rows(i, part))
    return Ground(view.cut, np.vstack(parts), np.concatenate(view.errors), result.pinned)
