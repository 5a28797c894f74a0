"""Tall least-squares problems, brought to triangular form by Householder reflections first.

N samples by n parameters become n by n without loss: ``|A x - b|`` and the singular values stay what they are
(G. H. Golub and C. F. Van Loan, Matrix Computations, chapter 5). Compiled here, and not left to the
linear-algebra library, since that spreads such a small problem over threads: on a rig whose cores are busy it
then waits 100 times longer than it computes.
"""

from __future__ import annotations

import numpy as np

from estimator.compiled import compiled
from estimator.signals.record import BoolArray, FloatArray

ROWS = 65536
"""Rows that are reduced at a time: half a megabyte each column."""


@compiled
def _reduce(work: FloatArray) -> None:
    """Turn work, shape (n, N), whose rows are the columns of A, into the rows of R^T, in place."""
    n, n_samples = work.shape
    for j in range(min(n, n_samples)):
        largest = 0.0
        for t in range(j, n_samples):
            largest = max(largest, abs(work[j, t]))
        if largest == 0.0:
            continue
        square = 0.0
        for t in range(j, n_samples):
            work[j, t] /= largest  # so that no square overflows or vanishes
            square += work[j, t] * work[j, t]
        norm = np.sqrt(square) if work[j, j] < 0.0 else -np.sqrt(square)
        head = work[j, j] - norm
        for k in range(j + 1, n):
            along = head * work[k, j]
            for t in range(j + 1, n_samples):
                along += work[j, t] * work[k, t]
            along /= -norm * head
            work[k, j] -= along * head
            for t in range(j + 1, n_samples):
                work[k, t] -= along * work[j, t]
        work[j, j] = norm * largest
        work[j, j + 1 :] = 0.0


def triangular(*columns: FloatArray, rows: BoolArray | None = None) -> FloatArray:
    """Return R, upper triangular, with ``R^T R = A^T A``, A the columns side by side.

    Rows are taken a part at a time, each below the R of those before (Golub and Van Loan, section 5.2): nothing as long
    as A is copied.
    """
    R, n_samples = np.zeros((0, sum(np.atleast_2d(column.T).shape[0] for column in columns))), columns[0].shape[0]
    for first in range(0, n_samples, ROWS):
        some = slice(first, first + ROWS)
        part = np.column_stack([column[some] if rows is None else column[some][rows[some]] for column in columns])
        work = np.ascontiguousarray(np.vstack([R, part]).T, dtype=np.float64)
        _reduce(work)
        R = np.ascontiguousarray(work[:, : min(work.shape)].T)
    return R


def solve_least_squares(A: FloatArray, b: FloatArray) -> FloatArray:
    """Return x of least ``|A x - b|``, shape (n,); of least norm where that leaves a choice."""
    n, R = A.shape[1], triangular(A, b)
    return np.asarray(np.linalg.lstsq(R[:n, :n], R[:n, n], rcond=None)[0], dtype=np.float64)


def singular_values(A: FloatArray) -> FloatArray:
    """Return the singular values of A, largest first, shape (min(N, n),)."""
    return np.asarray(np.linalg.svd(triangular(A), compute_uv=False), dtype=np.float64)
