"""Stable denominators by parametrisation: any real numbers x give an A whose roots lie inside the unit circle.

A is a product of second-order sections, and one of first order where its order is odd. The stability triangle of
``1 + a_1 q^-1 + a_2 q^-2`` is ``|a_2| < 1, |a_1| < 1 + a_2`` (E. I. Jury, Theory and Application of the z-Transform
Method, 1964), so that all of it and nothing else is reached by::

    a_2 = tanh x_2,    a_1 = (1 + a_2) tanh x_1,        first order: a_1 = tanh x

A minimiser over x needs no constraint, and a pole that the data push towards the unit circle does not stop it.
"""

from __future__ import annotations

import numpy as np

from estimator.signals.record import FloatArray

INSIDE = 1.0 - 1e-6
"""Stands for 1 in both: rounding then leaves every pole inside, the slowest with a time constant of 10^6 samples."""


def parameters_of(a: FloatArray) -> FloatArray:
    """Return x, shape (na,), of coefficients ``a_1 .. a_na``; poles on or outside the circle are moved inside."""
    poles = np.roots(np.concatenate([[1.0], a]))
    radius = np.abs(poles)
    poles = np.where(radius < 1.0, poles, poles / np.maximum(radius, 1.0) ** 2)
    pairs = poles[poles.imag > 0.0]
    real = np.sort(poles[poles.imag == 0.0].real)
    two = [(-2.0 * z.real, abs(z) ** 2) for z in pairs.tolist()]
    two += [(-(p + q), p * q) for p, q in zip(real[:-1:2].tolist(), real[1::2].tolist(), strict=True)]
    tangents = [t for a_1, a_2 in two for t in (a_1 / max(1.0 + a_2, 1.0 - INSIDE), a_2)]
    tangents += [-float(real[-1])] if real.size % 2 else []
    tangents += [0.0] * (a.shape[0] - len(tangents))  # leading coefficients that vanished have roots at 0
    return np.arctanh(np.clip(np.array(tangents) / INSIDE, -INSIDE, INSIDE))


def denominator_of(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return ``a_1 .. a_na`` of x, shape (na,), and their derivatives ``d a_i / d x_j``, shape (na, na)."""
    tangents = INSIDE * np.tanh(x)
    steepness = INSIDE - tangents**2 / INSIDE
    sections, slopes = [], []
    for i in range(0, x.shape[0] - 1, 2):
        t_1, t_2 = tangents[i : i + 2]
        sections.append(np.array([1.0, t_1 * (1.0 + t_2), t_2]))
        slopes.append(np.array([0.0, steepness[i] * (1.0 + t_2), 0.0]))
        slopes.append(steepness[i + 1] * np.array([0.0, t_1, 1.0]))
    if x.shape[0] % 2:
        sections.append(np.array([1.0, tangents[-1]]))
        slopes.append(np.array([0.0, steepness[-1]]))
    columns = [np.convolve(_product(sections, without=j // 2), slope)[1:] for j, slope in enumerate(slopes)]
    return _product(sections)[1:], np.array(columns).reshape(x.shape[0], x.shape[0]).T


def _product(sections: list[FloatArray], without: int = -1) -> FloatArray:
    product = np.ones(1)
    for i, section in enumerate(sections):
        if i != without:
            product = np.convolve(product, section)
    return product
