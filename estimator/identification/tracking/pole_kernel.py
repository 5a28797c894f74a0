"""Poles and the dominant mode of a model in a compiled loop: what ``modes.resonance`` says, fast enough for every sample.

Roots by simultaneous iteration (Weierstrass; E. Durand 1960, I. O. Kerner, Numer. Math. 8, 1966)::

    z_i  <-  z_i - A(z_i) / prod_{j != i} (z_i - z_j)

always from the same starting points, which lie on no axis of symmetry, so that the poles of a model depend on the
model alone, and not on those before it. Quadratic convergence: a model of order four takes about ten rounds.
"""

from __future__ import annotations

import numpy as np

from estimator.compiled import compiled
from estimator.identification.linear_model import ComplexArray
from estimator.signals.record import FloatArray

ROUNDS = 60
"""Rounds allowed; only poles that (nearly) coincide take so many."""

CONVERGED = 1e-13
"""Change of a pole by which it is taken as found; poles of interest have a magnitude near 1."""

COINCIDING = 1e-5
"""Change after all the rounds up to which poles that coincide are taken as found: rounding leaves a double one 1e-8."""

START = 0.4 + 0.9j  # no root of unity, and neither real nor imaginary: Durand's own choice

# Places in what `dominant` fills.
FREQUENCY_HZ, DAMPING, HEIGHT = 0, 1, 2


@compiled
def find_poles(a: FloatArray, z: ComplexArray) -> bool:
    """Set z, shape (na,), to the roots of z^na + a_1 z^(na-1) + ... + a_na; tell whether they were found."""
    n = a.shape[0]
    point = 1.0 + 0.0j
    for i in range(n):
        z[i] = point
        point *= START
    largest = np.inf
    for _ in range(ROUNDS):
        largest = 0.0
        for i in range(n):
            value = 1.0 + 0.0j
            for j in range(n):
                value = value * z[i] + a[j]
            apart = 1.0 + 0.0j
            for j in range(n):
                if j != i:
                    apart *= z[i] - z[j]
            step = value / apart
            z[i] -= step
            largest = max(largest, abs(step.real) + abs(step.imag))
        if largest < CONVERGED:
            break
    return largest < COINCIDING


@compiled
def height(b: FloatArray, nk: int, z: ComplexArray, i: int) -> float:
    """Return |residue of B / A at pole i| / distance of the pole from the unit circle."""
    q = 1.0 / z[i]
    numerator = 0.0 + 0.0j
    for j in range(b.shape[0] - 1, -1, -1):
        numerator = numerator * q + b[j]
    for _ in range(nk):
        numerator *= q
    for j in range(z.shape[0]):
        if j != i:
            numerator /= 1.0 - z[j] * q
    return abs(numerator) / max(1.0 - abs(z[i]), 1e-12)


@compiled
def dominant(
    theta: FloatArray, na: int, nk: int, sample_time_s: float, band_hz: FloatArray, z: ComplexArray, mode: FloatArray
) -> int:
    """Find the dominant lightly damped mode, as ``modes.resonance`` does.

    Parameters
    ----------
    theta
        ``a_1 .. a_na, b_1 .. b_nb``.
    band_hz
        Lowest and highest natural frequency [Hz], largest damping ratio; shape (3,).
    z
        Filled with the poles, shape (na,).
    mode
        Filled with natural frequency [Hz], damping ratio and height, shape (3,).

    Returns
    -------
    int
        Place of its pole in z; -1 where there is none.
    """
    best = -1
    if not find_poles(theta[:na], z):
        return best
    for i in range(na):
        if z[i].imag <= 1e-9 * abs(z[i]):  # a real pole does not oscillate, at whatever sampled frequency
            continue
        s = np.log(z[i]) / sample_time_s
        frequency_hz = abs(s) / (2.0 * np.pi)
        damping = -s.real / abs(s)
        if not (band_hz[0] <= frequency_hz <= band_hz[1] and abs(damping) < band_hz[2]):
            continue
        tall = height(theta[na:], nk, z, i)
        if best < 0 or tall > mode[HEIGHT]:
            best = i
            mode[FREQUENCY_HZ], mode[DAMPING], mode[HEIGHT] = frequency_hz, damping, tall
    return best


@compiled
def mode_gradient(z: ComplexArray, i: int, sample_time_s: float, frequency: FloatArray, damping: FloatArray) -> None:
    """Set the gradients of natural frequency [Hz] and damping ratio of pole i over a_1 .. a_na, each of shape (na,).

    From A(z_i) = 0: dz_i / da_k = - z_i^(na-k) / A'(z_i), and s = ln(z) / T.
    """
    n = z.shape[0]
    slope = 1.0 + 0.0j
    for j in range(n):
        if j != i:
            slope *= z[i] - z[j]
    s = np.log(z[i]) / sample_time_s
    magnitude = abs(s)
    power = 1.0 + 0.0j
    for k in range(n - 1, -1, -1):
        ds = -power / slope / (z[i] * sample_time_s)
        along = (s.real * ds.real + s.imag * ds.imag) / magnitude
        frequency[k] = along / (2.0 * np.pi)
        damping[k] = -ds.real / magnitude + s.real * along / (magnitude * magnitude)
        power *= z[i]
