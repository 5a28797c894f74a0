"""How poles and zeros move with the coefficients of a model.

A simple root z of ``c_0 z^n + ... + c_n`` moves with its coefficients by ``dz / dc_i = -z^(n-i) / p'(z)``. At a double
root p' vanishes: its standard deviation is infinite, which is what the data say.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimator.identification.linear_model import ComplexArray, LinearModel
from estimator.signals.record import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Roots:
    """Roots, shape (n,), and their derivatives by theta, shape (n, na + nb), complex."""

    values: ComplexArray
    slopes: ComplexArray


def _roots(coefficients: FloatArray, first: int, place: int, n_parameters: int) -> Roots:
    """Return the roots of a polynomial whose coefficients from ``first`` on are theta from ``place`` on."""
    values = np.asarray(np.roots(coefficients), dtype=np.complex128)
    degree = coefficients.shape[0] - 1
    slopes = np.zeros((values.shape[0], n_parameters), dtype=np.complex128)
    with np.errstate(divide="ignore", invalid="ignore"):
        p_prime = np.polyval(np.polyder(coefficients), values)
        for i in range(first, degree + 1):
            slopes[:, place + i - first] = -(values ** (degree - i)) / p_prime
    return Roots(values, slopes)


def pole_roots(model: LinearModel) -> Roots:
    """Return the poles of a model with their derivatives."""
    return _roots(model.A, 1, 0, model.orders.n_parameters)


def zero_roots(model: LinearModel) -> Roots:
    """Return the zeros of a model with their derivatives."""
    return _roots(np.array(model.b), 0, len(model.a), model.orders.n_parameters)


def covariance_of(slope: ComplexArray, P: FloatArray) -> FloatArray:
    """Return the covariance of (Re, Im) of a complex number with this derivative; infinite at a double root."""
    if not np.isfinite(slope).all():
        return np.diag([np.inf, np.inf])
    G = np.array([slope.real, slope.imag])
    return np.asarray(G @ P @ G.T, dtype=np.float64)
