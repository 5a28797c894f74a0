"""The linear model that every estimator here fits, its conventions, and the least-squares solver that they share.

::

    y(t) = - a_1 y(t-1) - ... - a_na y(t-na) + b_1 u(t-nk) + ... + b_nb u(t-nk-nb+1)

    B(q^-1)   b_1 q^-nk + ... + b_nb q^-(nk+nb-1)
    ------- = -----------------------------------        theta = [a_1 .. a_na, b_1 .. b_nb]
    A(q^-1)   1 + a_1 q^-1 + ... + a_na q^-na

- ``nk`` is the *total* delay between u and y. A sampled mechanical system with a zero-order hold has nk = 1.
  The paper's d = 1 is nk = 1. Where another text counts a pure delay d on top of that one, ``nk = d + 1``.
- ``na`` is the order of A in *this* output-error model; MATLAB calls it nf there and keeps na for ARX.
- Poles and zeros are those in z.

Tall least-squares problems are brought to triangular form by Householder reflections first (`triangular`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.compiled import compiled
from estimator.errors import BadModel, BadShape
from estimator.signals.record import BoolArray, FloatArray
from estimator.signals.settings import Requirement, is_positive, require

ROWS = 65536  # rows that are reduced at a time: half a megabyte each column


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
    """Return R, upper triangular, with ``R^T R = A^T A``, A the columns side by side."""
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


ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Orders:
    """Structure of the model: na, nb coefficients and total delay nk in samples.

    Raises
    ------
    BadSetting
        If an order is negative or nb is 0.
    """

    na: int = 4  # coefficients of A behind its leading 1
    nb: int = 4  # coefficients of B
    nk: int = 1  # samples from u to its first effect on y; 1 for a torque held until the next row

    def __post_init__(self) -> None:
        require(
            "model orders",
            (
                Requirement("na", self.na, self.na >= 0, "0 or more"),
                Requirement("nb", self.nb, self.nb >= 1, "1 or more"),
                Requirement("nk", self.nk, self.nk >= 0, "a delay of 0 or more samples"),
            ),
        )

    @property
    def n_parameters(self) -> int:
        """Length of theta."""
        return self.na + self.nb

    @property
    def n_states(self) -> int:
        """Number of past values that fix the free response."""
        return max(self.na, self.nk + self.nb - 1)

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each entry of theta, ``a_1 .. a_na, b_1 .. b_nb``."""
        a = [f"a_{i}" for i in range(1, self.na + 1)]
        return (*a, *(f"b_{j}" for j in range(1, self.nb + 1)))


@dataclass(frozen=True, slots=True)
class LinearModel:
    """A transfer function B / A with its sampling period.

    Attributes
    ----------
    a, b : tuple of float
        ``a_1 .. a_na`` and ``b_1 .. b_nb``.
    nk : int
        Total delay in samples.
    sample_time_s : float
        Sampling period [s].

    Raises
    ------
    BadModel
        If a coefficient is not finite.
    """

    a: tuple[float, ...]  # a_1 ... a_na of A
    b: tuple[float, ...]  # b_1 ... b_nb of B [output unit per input unit]
    nk: int
    sample_time_s: float

    def __post_init__(self) -> None:
        Orders(len(self.a), len(self.b), self.nk)
        fits = is_positive(self.sample_time_s)
        require("linear model", (Requirement("sample_time_s", self.sample_time_s, fits, "above 0 s"),))
        if not np.isfinite(self.theta).all():
            raise BadModel(f"linear model: theta is {self.theta}, expected finite coefficients only.")

    @classmethod
    def from_theta(cls, theta: FloatArray, orders: Orders, sample_time_s: float) -> LinearModel:
        """Build the model of a parameter vector ``theta``, shape (na+nb,).

        Raises
        ------
        BadShape
            If theta does not have na + nb entries.
        """
        if theta.shape != (orders.n_parameters,):
            raise BadShape(
                f"linear model: theta has shape {theta.shape}, expected ({orders.n_parameters},) for "
                f"na = {orders.na} and nb = {orders.nb}."
            )
        values = [float(value) for value in theta]
        return cls(tuple(values[: orders.na]), tuple(values[orders.na :]), orders.nk, sample_time_s)

    @property
    def theta(self) -> FloatArray:
        """Parameter vector, shape (na+nb,)."""
        return np.array([*self.a, *self.b])

    @property
    def orders(self) -> Orders:
        """Structure of the model."""
        return Orders(len(self.a), len(self.b), self.nk)

    @property
    def A(self) -> FloatArray:
        """Denominator in q^-1, shape (na+1,), leading 1."""
        return np.array([1.0, *self.a])

    @property
    def B(self) -> FloatArray:
        """Numerator in q^-1, shape (nk+nb,), nk leading zeros."""
        return np.array([*[0.0] * self.nk, *self.b])

    @property
    def poles(self) -> ComplexArray:
        """Roots of A in z, shape (na,)."""
        return np.asarray(np.roots(self.A), dtype=np.complex128)

    @property
    def zeros(self) -> ComplexArray:
        """Roots of b_1 z^(nb-1) + ... + b_nb, shape (nb-1,) or fewer where leading b vanish."""
        return np.asarray(np.roots(np.array(self.b)), dtype=np.complex128)

    @property
    def is_stable(self) -> bool:
        """Tell whether every pole is inside the unit circle."""
        return bool((np.abs(self.poles) < 1.0).all())

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """Return the frequency response B / A [output unit per input unit] at frequencies [Hz]."""
        q = np.exp(-2j * np.pi * np.asarray(frequency_hz) * self.sample_time_s)
        numerator = np.polynomial.polynomial.polyval(q, self.B)
        return np.asarray(numerator / np.polynomial.polynomial.polyval(q, self.A), dtype=np.complex128)

    def simulate(self, u: FloatArray, state: FloatArray | None = None) -> FloatArray:
        """Free-run simulation: the output from the input alone, no measured output fed back.

        Parameters
        ----------
        u : ndarray, shape (N,)
            Input.
        state : ndarray, shape (n_states,), optional
            ``c`` of the free response ``C(q^-1) / A(q^-1)`` of the time before; zero (at rest) by default.

        Returns
        -------
        ndarray, shape (N,)
            Output.
        """
        from scipy.signal import lfilter  # a second to import, and on line there is no simulation

        output = np.asarray(lfilter(self.B, self.A, u), dtype=np.float64)
        if state is None:
            return output
        return output + free_response(self.A, state, u.shape[0])


def free_response(A: FloatArray, state: FloatArray, n_samples: int) -> FloatArray:
    """Return the first ``n_samples`` of C(q^-1) / A(q^-1), the response to what was before, shape (N,)."""
    from scipy.signal import lfilter  # see above

    impulse = np.zeros(max(n_samples, state.shape[0]))
    impulse[: state.shape[0]] = state
    return np.asarray(lfilter([1.0], A, impulse), dtype=np.float64)[:n_samples]


def products_of_past(e: FloatArray, p: int) -> FloatArray:
    """Return ``sum_t e(t-1-i) e(t-1-j)`` over all t with p samples before them, shape (p, p).

    Each diagonal follows from its first product and what enters and leaves at the ends (M. Morf, B. Dickinson, T.
    Kailath and A. Vieira, IEEE Trans. ASSP 25, 1977): p products per sample in place of p^2.
    """
    products = np.empty((p, p))
    products[0] = products[:, 0] = np.correlate(e[:-1], e[p - 1 : -1], "valid")[::-1]
    enters, leaves = e[: p - 1][::-1], e[-p:-1][::-1]
    for i in range(p - 1):
        products[i + 1, 1:] = products[i, :-1] + enters[i] * enters - leaves[i] * leaves
    return products
