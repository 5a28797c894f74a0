"""What was not measured: outputs and torque that are unknowns of a fit, and are eliminated from its whitened errors."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from estimator.identification.linear_model import LinearModel
from estimator.signals.record import BoolArray, FloatArray

MOST_UNREAD = 200
"""Unknowns spent on torque that was not read: their cost grows with the square. Beyond, the torque held stands."""

DEPENDENT = 1e-9
"""Singular value, against the largest, below which an unknown of the torque changes nothing by itself."""

RIDGE = 1e-12  # keeps an output that no whitened error depends on from making the normal equations singular


class _Outputs:
    """Elimination of outputs alone: the normal equations of sparse responses W, shape (n, m)."""

    def __init__(self, W: csc_array) -> None:
        self.W = W
        self._normal = splu(csc_array(W.T @ W + RIDGE * diags_array(np.ones(W.shape[1]))))

    def values(self, w: FloatArray) -> FloatArray:
        """Return what explains w best, shape (m,) or (m, columns)."""
        return np.asarray(self._normal.solve(np.asarray(self.W.T @ w)), dtype=np.float64)

    def without(self, w: FloatArray) -> FloatArray:
        """Return w less what the outputs explain."""
        return np.asarray(w - self.W @ self.values(w), dtype=np.float64)


class Elimination:
    """The projection onto what no missing sample explains, and the values of what is missing."""

    def __init__(self, outputs: csc_array | None, inputs: FloatArray | None) -> None:
        self._outputs = None if outputs is None else _Outputs(outputs)
        self._inputs, self._basis, self._inverse = inputs, np.zeros((0, 0)), np.zeros((0, 0))
        if inputs is not None:
            left, sizes, right = np.linalg.svd(self._without_outputs(inputs), full_matrices=False)
            kept = sizes > DEPENDENT * sizes[0]
            self._basis, self._inverse = left[:, kept], right[kept].T / sizes[kept]
        self.n_unknowns = (0 if outputs is None else int(outputs.shape[1])) + self._basis.shape[1]

    def without(self, x: FloatArray) -> FloatArray:
        """Return the projection of whitened samples, shape (n,) or (n, columns)."""
        rest = self._without_outputs(x)
        if self._inputs is None:
            return rest
        return np.asarray(rest - self._basis @ (self._basis.T @ rest), dtype=np.float64)

    def values(self, w: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what the unknown outputs, shape (m,), and inputs, shape (k,), must be for the least ``|w|``."""
        inputs = np.zeros(0)
        if self._inputs is not None:
            inputs = -self._inverse @ (self._basis.T @ self._without_outputs(w))
            w = w + self._inputs @ inputs
        return np.zeros(0) if self._outputs is None else -self._outputs.values(w), inputs

    def _without_outputs(self, x: FloatArray) -> FloatArray:
        return x if self._outputs is None else self._outputs.without(x)


class OutputResponses:
    """Where unmeasured outputs enter the whitened errors; only the values change with D."""

    def __init__(self, okay: BoolArray, order: int) -> None:
        missing = np.flatnonzero(~okay)
        lag = np.arange(order + 1)
        rows = missing[:, np.newaxis] + lag - order
        inside = (rows >= 0) & (rows < okay.shape[0] - order)
        self._rows, self._lag = rows[inside], np.broadcast_to(lag, rows.shape)[inside]
        self._ends = np.concatenate([[0], np.cumsum(inside.sum(axis=1))])
        self._shape = (okay.shape[0] - order, missing.shape[0])

    def of(self, D: FloatArray) -> csc_array | None:
        """Return the responses for a noise model; None where every output was measured."""
        return csc_array((D[self._lag], self._rows, self._ends), shape=self._shape) if self._shape[1] else None


class UnreadTorque:
    """The unknowns of torque that was not read: one a sample; of a gap longer than the state, the state at its end."""

    def __init__(self, read: BoolArray | None, n_states: int) -> None:
        self.at: list[int] = []
        self.is_input: list[bool] = []
        for start, end in [] if read is None else gaps(read):
            short = end - start <= n_states
            self.at += range(start if short else end - n_states, end)
            self.is_input += [short] * min(end - start, n_states)
        if len(self.at) > MOST_UNREAD:
            self.at, self.is_input = [], []

    def responses(self, model: LinearModel, n_samples: int) -> FloatArray | None:
        """Return the model's response to each unknown, shape (N, k); None if there is none."""
        if not self.at:
            return None
        impulse = np.zeros(n_samples)
        impulse[0] = 1.0
        at_input, at_state = (lfilter(numerator, model.A, impulse) for numerator in (model.B, np.ones(1)))
        columns = np.zeros((n_samples, len(self.at)))
        for j, (t, is_input) in enumerate(zip(self.at, self.is_input, strict=True)):
            columns[t:, j] = (at_input if is_input else at_state)[: n_samples - t]
        return columns

    def added_to(self, u: FloatArray, values: FloatArray) -> FloatArray:
        """Return a copy of u (N,) with the estimated values of what was not read added."""
        filled = u.copy()
        inputs = np.array(self.is_input, dtype=np.bool_)
        filled[np.array(self.at, dtype=np.int64)[inputs]] += values[inputs]
        return filled


def gaps(okay: BoolArray) -> list[tuple[int, int]]:
    """Return start and end (exclusive) of each run of samples that are not okay."""
    edges = np.flatnonzero(np.diff(np.concatenate([[True], okay, [True]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
