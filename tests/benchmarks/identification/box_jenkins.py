"""A Box-Jenkins estimator in thirty lines of scipy: what anybody could write, to measure ours against.

``y = B / A u + 1 / D w`` with D of order 50: A and B by least squares on data filtered by D, D by least squares on what
A and B leave, in turn. It starts from an ARX model of order 50, whose A makes the noise white, and from the iteration
of K. Steiglitz and L. McBride (IEEE Transactions on Automatic Control 10, 1965) on data filtered by that.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import toeplitz
from scipy.optimize import least_squares
from scipy.signal import lfilter

from tests.benchmarks.buses.line import Array

ORDER, NOISE_ORDER, TURNS = 3, 50, 8
OUTSIDE = 1e3
"""Error at an unstable trial, so that the step is refused."""


def box_jenkins(u: Array, y: Array) -> Array:
    """Return the poles in z of the model between u and y."""
    theta = _start(u, y)
    for _ in range(TURNS):
        v = y - lfilter(*_polynomials(theta), u)
        D = np.concatenate([[1.0], -_regression(_past(v, NOISE_ORDER), v)])
        filtered = lfilter(D, [1.0], u), lfilter(D, [1.0], y)
        before, theta = theta, least_squares(_error, theta, x_scale=np.abs(theta) + 1e-9, args=filtered).x
        if np.allclose(theta, before, rtol=1e-6):
            break
    return np.roots(_polynomials(theta)[1])


def _start(u: Array, y: Array) -> Array:
    whitening = np.concatenate([[1.0], -_regression(np.hstack([_past(y, NOISE_ORDER), _past(u, NOISE_ORDER)]), y)])
    u, y = (lfilter(whitening[: NOISE_ORDER + 1], [1.0], x) for x in (u, y))
    theta = np.zeros(2 * ORDER)
    for _ in range(TURNS):
        a = _polynomials(theta)[1]
        u_a, y_a = lfilter([1.0], a, u), lfilter([1.0], a, y)
        theta = _regression(np.hstack([-_past(y_a, ORDER), _past(u_a, ORDER)]), y_a)
        poles = np.roots(_polynomials(theta)[1])
        theta[:ORDER] = np.real(np.poly(np.where(np.abs(poles) < 1.0, poles, 1.0 / poles.conj())))[1:]
    return theta


def _regression(past: Array, x: Array) -> Array:
    """Return the coefficients of x on its past, without the samples at the beginning that have none."""
    return np.linalg.lstsq(past[NOISE_ORDER:], x[NOISE_ORDER:], rcond=None)[0]


def _past(x: Array, lags: int) -> Array:
    """Return the columns x(t-1) to x(t-lags), shape (N, lags)."""
    return toeplitz(np.concatenate([[0.0], x[:-1]]), np.zeros(lags))


def _polynomials(theta: Array) -> tuple[Array, Array]:
    """Return B and A in q^-1."""
    return np.concatenate([[0.0], theta[ORDER:]]), np.concatenate([[1.0], theta[:ORDER]])


def _error(theta: Array, u: Array, y: Array) -> Array:
    b, a = _polynomials(theta)
    error = y - lfilter(b, a, u) if np.abs(np.roots(a)).max() < 1.0 else np.full(y.shape, OUTSIDE)
    return error[NOISE_ORDER:]
