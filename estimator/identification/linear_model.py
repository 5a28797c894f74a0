"""The discrete-time transfer function that is identified, and the conventions, stated once.

::

    y(t) = - a_1 y(t-1) - ... - a_na y(t-na) + b_1 u(t-nk) + ... + b_nb u(t-nk-nb+1)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.errors import BadModel, BadShape
from estimator.signals.record import FloatArray
from estimator.signals.settings import Requirement, is_positive, require

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Orders:
    """Structure of the model: na, nb coefficients and total delay nk in samples.

    Raises
    ------
    BadSetting
        If an order is negative or nb is 0.
    """

    na: int = 4
    nb: int = 4
    nk: int = 1

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

    a: tuple[float, ...]
    b: tuple[float, ...]
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
