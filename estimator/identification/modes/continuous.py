"""The continuous-time transfer function that a sampled model with held input came from.

With the input held between samples, ``exp([[A_c, B_c], [0, 0]] T) = [[A, B], [0, 1]]`` (K. J. Astrom and B.
Wittenmark, Computer-Controlled Systems, chapter 2); its matrix logarithm takes the model back. There is none where a
pole in z is 0 or real and negative: no continuous system has such a sample.

The zeros come back exactly too, which ``ln(z) / T`` does not do for them. But the input must have been held: signals
that were decimated through a low-pass were not, and their zeros, unlike their poles, are off. Take a model at the
recording's own period for zeros and physical parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import logm

from estimator.errors import BadModel
from estimator.identification.linear_model import ComplexArray, LinearModel
from estimator.identification.modes.modes import Mode
from estimator.signals.record import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class ContinuousModel:
    """``numerator(s) / denominator(s)``, highest power first, leading 1 in the denominator."""

    numerator: FloatArray
    denominator: FloatArray

    @property
    def poles(self) -> ComplexArray:
        """Roots of the denominator [1/s]."""
        return np.asarray(np.roots(self.denominator), dtype=np.complex128)

    @property
    def zeros(self) -> ComplexArray:
        """Roots of the numerator [1/s]."""
        return np.asarray(np.roots(self.numerator), dtype=np.complex128)

    @property
    def antiresonance(self) -> Mode | None:
        """The least damped oscillating pair of zeros; None if no zeros oscillate."""
        pairs = [complex(s) for s in self.zeros if s.imag > 0.0]
        if not pairs:
            return None
        s = min(pairs, key=lambda pair: abs(pair.real) / abs(pair))
        return Mode(abs(s) / (2.0 * np.pi), -s.real / abs(s))


def state_space(model: LinearModel) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Return (A, B, C, D) of the model in controller form; the delay is part of it.

    Shapes (n, n), (n, 1), (1, n) with n = max(na, nk + nb - 1).
    """
    n = model.orders.n_states
    a, b = np.zeros(n), np.zeros(n + 1)
    a[: len(model.a)] = model.a
    b[: model.B.shape[0]] = model.B
    A = np.eye(n, k=-1)
    A[:1] = -a
    C = (b[1:] - b[0] * a)[np.newaxis]
    return A, np.eye(n, 1), C, float(b[0])


def numerator_of(A: FloatArray, B: FloatArray, C: FloatArray, D: float) -> FloatArray:
    """Return the coefficients of ``C adj(xI - A) B + D det(xI - A)``, highest power first, shape (n+1,)."""
    denominator = np.real(np.poly(A))
    return np.asarray(np.real(np.poly(A - B @ C)) + (D - 1.0) * denominator, dtype=np.float64)


def to_continuous(model: LinearModel) -> ContinuousModel:
    """Take a sampled model back to the continuous one with held input.

    Raises
    ------
    BadModel
        If a pole is 0 or real and negative, or there is none at all.
    """
    A, B, C, D = state_space(model)
    poles = np.linalg.eigvals(A)
    without = [complex(z) for z in poles if abs(z) < np.finfo(np.float64).eps or (z.imag == 0.0 and z.real < 0.0)]
    if without or not poles.size:
        raise BadModel(
            f"linear model: poles {np.round(poles, 4).tolist()} in z, expected none at 0 or real and negative: no "
            "continuous system has such samples. Take the third-order equivalent, or fit with fewer coefficients."
        )
    n = A.shape[0]
    block = np.zeros((n + 1, n + 1))
    block[:n, :n], block[:n, n:], block[n, n] = A, B, 1.0
    rate = np.real(logm(block)) / model.sample_time_s
    A_c, B_c = rate[:n, :n], rate[:n, n:]
    return ContinuousModel(numerator_of(A_c, B_c, C, D), np.real(np.poly(A_c)))
