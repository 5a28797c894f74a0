"""What is left of a signal once everything that re-tuning could explain, to first order, has been taken out."""

from __future__ import annotations

import numpy as np

from estimator.physics.bounded import least_inside, unbounded_first
from estimator.physics.fit import FitResult
from estimator.physics.problem import bounds
from estimator.signals.record import FloatArray


class Projector:
    """Takes out of stacked signals what the unknowns of a fit could explain, to first order.

    Attributes
    ----------
    error : ndarray, shape (R,)
        What is left of the fit's own error once the unknowns that are not at a bound have moved freely.
    """

    def __init__(self, result: FitResult) -> None:
        low, high = bounds(result.problem)
        jacobian = result.jacobian
        movable = unbounded_first(low, high, (low < high) & jacobian.any(axis=0))
        self._free = np.linalg.qr(jacobian[:, ~result.pinned])[0]
        self._all, self._triangle = np.linalg.qr(jacobian[:, movable])
        x = result.x[movable]
        self._room = low[movable] - x, high[movable] - x
        self._residual, self._rows = result.residual, result.problem.rows
        self.error = self.rest(result.residual)

    def rest(self, signals: FloatArray) -> FloatArray:
        """Return what is left of stacked signals, shape (..., R)."""
        left: FloatArray = signals - (signals @ self._free) @ self._free.T
        return left

    def products(self, answers: FloatArray, index: int) -> tuple[FloatArray, FloatArray]:
        """Return the products of what is left of answers with each other, (K, K), and with ``error``, (K,).

        The answers, shape (K, R_i), are one recording's own, its outputs in turn: they are 0 in all other rows.
        """
        rows = self._rows[index]
        seen = answers @ self._free[rows]
        return answers @ answers.T - seen @ seen.T, answers @ self.error[rows]

    def promise(self, direction: FloatArray, low: float, high: float) -> tuple[float, float]:
        """Return how far to go along a direction, within bounds, and by how much the squared error falls.

        The unknowns move along within their own bounds, so that one that was pressed against a bound can come back.
        """
        along, across = self._all.T @ direction, 0.0
        rest = direction - self._all @ along
        across = float(np.linalg.norm(rest))
        if across == 0.0:
            return 0.0, 0.0
        target = -np.append(self._all.T @ self._residual, float(rest @ self._residual) / across)
        corner = np.append(np.zeros(along.size), across)
        triangle = np.vstack([np.column_stack([self._triangle, along]), corner])
        lowest, highest = np.append(self._room[0], low), np.append(self._room[1], high)
        moved = least_inside(triangle, target, np.minimum(lowest, 0.0), np.maximum(highest, 0.0))
        left = triangle @ moved - target
        return float(moved[-1]), float(target @ target - left @ left)
