"""The third-order equivalent: what the paper's pole-zero map shows of its fourth-order models.

A drive of two masses has three states: one rigid motion and one twist with its rate. A model of fourth order that fits
it holds one more, which a zero nearly cancels or which stands for what the sampling did. Balanced truncation (B. C.
Moore, IEEE Trans. Automatic Control 26, 1981) leaves out the states that are both hard to reach from the input and
hard to see in the output. Its error is bounded at every frequency (D. F. Enns, 1984)::

    |G(f) - G_r(f)|  <=  2 (sigma_(r+1) + ... + sigma_n),    sigma the Hankel singular values

With the input held between samples, ``exp([[A_c, B_c], [0, 0]] T) = [[A, B], [0, 1]]`` (Astrom and Wittenmark,
Computer-Controlled Systems, chapter 2); its matrix logarithm takes a sampled model back to continuous time, zeros and
all. Signals that were decimated through a low-pass were not held: their zeros, unlike their poles, are off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import logm, schur

from estimator.errors import BadModel, BadShape
from estimator.identification.linear_model import ComplexArray, LinearModel
from estimator.identification.modes.modes import propagate, square_root
from estimator.signals.record import FloatArray

THIRD = 3

MOST_DOUBLINGS = 17
"""2^17 samples, longer than most recordings: what a pole does beyond was not seen, and where many poles crowd together
at 1, as those of fast recordings do, rounding may put one of them outside."""


@dataclass(frozen=True, slots=True, eq=False)
class ContinuousModel:
    """``numerator(s) / denominator(s)``, highest power first, leading 1 in the denominator."""

    numerator: FloatArray  # (m,) [output unit per input unit]
    denominator: FloatArray  # (n,)

    @property
    def poles(self) -> ComplexArray:
        """Roots of the denominator [1/s]."""
        return np.asarray(np.roots(self.denominator), dtype=np.complex128)

    @property
    def zeros(self) -> ComplexArray:
        """Roots of the numerator [1/s]."""
        return np.asarray(np.roots(self.numerator), dtype=np.complex128)


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
    """Take a sampled model back to the continuous one with held input."""
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


@dataclass(frozen=True, slots=True, eq=False)
class Reduced:
    """A model of lower order and what it left out."""

    model: LinearModel  # of the order asked for, or of the original one where that is no higher
    covariance: FloatArray | None  # of its theta
    hankel: FloatArray  # Hankel singular values of the model before, the largest first
    largest_error: float  # bound of the difference of the responses at any frequency [output unit per input unit]


def third_order(model: LinearModel, covariance: FloatArray | None = None) -> Reduced:
    """Return a model reduced to third order: the rigid line and one resonance."""
    return reduce_order(model, THIRD, covariance)


def reduce_order(model: LinearModel, order: int, covariance: FloatArray | None = None) -> Reduced:
    """As :func:`third_order`, for any order above 0."""
    if not model.is_stable:
        raise BadModel(
            f"linear model: poles of radius {np.sort(np.abs(model.poles))[::-1].round(4).tolist()}, expected all below "
            "1: an unstable model has no equivalent of lower order. Use the last stable estimate."
        )
    n = model.orders.n_parameters
    if covariance is not None and covariance.shape != (n, n):
        raise BadShape(f"linear model: its covariance has shape {covariance.shape}, expected ({n}, {n}).")
    theta, hankel = _truncated(model, order)
    reduced = _as_model(theta, model, order)
    spread = None
    if covariance is not None:
        spread = propagate(lambda x: _truncated(_like(x, model), order)[0], model.theta, covariance)[1]
    return Reduced(reduced, spread, hankel, 2.0 * float(np.sum(hankel[order:])))


def _gramian(A: FloatArray, Q: FloatArray) -> FloatArray:
    """Return the sum of ``A^k Q (A^T)^k`` over k, by doubling (R. A. Smith, SIAM J. Applied Mathematics 16, 1968)."""
    total, power = Q, A
    for _ in range(MOST_DOUBLINGS):
        total, power = total + power @ total @ power.T, power @ power
        if np.abs(power).max() < np.finfo(np.float64).eps:
            break
    return np.asarray(total, dtype=np.float64)


def _like(theta: FloatArray, model: LinearModel) -> LinearModel:
    return LinearModel.from_theta(theta, model.orders, model.sample_time_s)


def _as_model(theta: FloatArray, original: LinearModel, order: int) -> LinearModel:
    n = min(order, original.orders.n_states)
    a, b = tuple(theta[:n].tolist()), tuple(theta[n:].tolist())
    return LinearModel(a, b, min(original.nk, 1), original.sample_time_s)


def _triangular_form(
    A: FloatArray, B: FloatArray, C: FloatArray, D: float
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Return the states in their Schur form: powers of A then keep its poles, which rounding else puts outside."""
    T, Z = schur(A)
    radius = float(np.abs(np.linalg.eigvals(T)).max(initial=0.0))
    return T * min(1.0, (1.0 - 1e-9) / max(radius, 0.5)), Z.T @ B, C @ Z, D


def _truncated(model: LinearModel, order: int) -> tuple[FloatArray, FloatArray]:
    """Return theta of the truncated model and the Hankel singular values.

    With a delay of 1 or more theta is ``[a_1 .. a_r, b_1 .. b_r]``, without ``[a_1 .. a_r, b_0 .. b_r]``.
    """
    A, B, C, D = _triangular_form(*state_space(model))
    reach = square_root(_gramian(A, B @ B.T))
    see = square_root(_gramian(A.T, C.T @ C))
    left, hankel, right_t = np.linalg.svd(see.T @ reach)
    kept = min(order, A.shape[0])
    scale = 1.0 / np.sqrt(np.maximum(hankel[:kept], np.finfo(np.float64).tiny))
    to_kept = scale[:, np.newaxis] * (see @ left[:, :kept]).T
    from_kept = reach @ right_t[:kept].T * scale
    A_r, B_r, C_r = to_kept @ A @ from_kept, to_kept @ B, C @ from_kept
    denominator = np.real(np.poly(A_r))
    numerator = numerator_of(A_r, B_r, C_r, D)
    theta = np.concatenate([denominator[1:], numerator[1:] if model.nk >= 1 else numerator])
    return np.asarray(theta, dtype=np.float64), np.asarray(hankel, dtype=np.float64)
