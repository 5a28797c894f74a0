"""Poles and the dominant mode of a model in a compiled loop: ``modes.resonance``, fast enough for every sample.

Roots by simultaneous iteration (Weierstrass; E. Durand 1960, I. O. Kerner, Numer. Math. 8, 1966)::

    z_i  <-  z_i - A(z_i) / prod_{j != i} (z_i - z_j)

A mode is the part rho / (1 - p q^-1) and its conjugate in the partial fractions of B / A. With the residue rho held,
its output changes with the natural frequency f by::

    psi(t) = dy/df = 2 Re [ rho dp/df q^-1 / (1 - p q^-1)^2 ] u(t),      dp/df = 2 pi T p (-zeta + j sqrt(1 - zeta^2))

It converges quadratically: from the poles of the sample before in two or three rounds. Two real poles that become a
pair can't be found so, since real values stay real; then, and at the start, the rounds begin at points that lie on no
axis of symmetry, and take about ten.
"""

from __future__ import annotations

import numpy as np

from estimator.compiled import compiled, inlined
from estimator.identification.linear_model import ComplexArray
from estimator.signals.record import FloatArray

ROUNDS = 60  # rounds allowed from the fixed points; only poles that (nearly) coincide take so many
WARM_ROUNDS = 6  # rounds allowed from the poles of the sample before
CONVERGED = 1e-13  # change of a pole by which it is taken as found; poles of interest have a magnitude near 1

COINCIDING = 1e-5
"""Change after all the rounds up to which poles that coincide are taken as found: rounding leaves a double one 1e-8."""

START = 0.4 + 0.9j  # no root of unity, and neither real nor imaginary: Durand's own choice

# Places in what `dominant` fills.
FREQUENCY_HZ, DAMPING, HEIGHT = 0, 1, 2

# Places in `through`: the torque's steps passed once and twice through 1 / (1 - pole q^-1), and the last torque.
ONCE_RE, ONCE_IM, TWICE_RE, TWICE_IM, LAST = 0, 1, 2, 3, 4
N_THROUGH = 5


@inlined
def squared(z: complex) -> float:
    """Return |z|^2, without the care that ``abs`` takes of numbers near the ends of the range."""
    return z.real * z.real + z.imag * z.imag


@inlined
def ratio(x: complex, y: complex) -> complex:
    """Return x / y; no number where y is 0, while the compiled division of complex numbers would raise."""
    size = squared(y)
    real, imag = x.real * y.real + x.imag * y.imag, x.imag * y.real - x.real * y.imag
    return complex(real / size, imag / size)


@inlined
def go_round(a: FloatArray, z: ComplexArray) -> float:
    """Do one round; return the largest change of a pole."""
    n = a.shape[0]
    largest = 0.0
    for i in range(n):
        value = 1.0 + 0.0j
        product = 1.0 + 0.0j
        for j in range(n):
            value = value * z[i] + a[j]
            if j != i:
                product *= z[i] - z[j]
        step = ratio(value, product)
        z[i] -= step
        change = abs(step.real) + abs(step.imag)
        largest = change if not change <= largest else largest  # NaN goes through
    return largest


@compiled
def find_poles(a: FloatArray, z: ComplexArray) -> bool:
    """Set z, shape (na,), to the roots of z^na + a_1 z^(na-1) + ... + a_na; tell whether they were found.

    ``z`` holds the poles of the sample before; zeros where there are none.
    """
    for _ in range(WARM_ROUNDS):
        change = go_round(a, z)
        if change < CONVERGED:
            return True
        if not change < 1.0:
            break
    point = 1.0 + 0.0j
    for i in range(a.shape[0]):
        z[i] = point
        point *= START
    change = np.inf
    for _ in range(ROUNDS):
        change = go_round(a, z)
        if change < CONVERGED:
            break
    return change < COINCIDING


@inlined
def angle_of(z: complex) -> float:
    """Return the angle of a pole above the real axis, by the one inverse function that a PLC has too."""
    if z.real == 0.0:
        return 0.5 * np.pi
    angle = float(np.arctan(z.imag / z.real))
    return angle + np.pi if z.real < 0.0 else angle


@inlined
def continuous(z: complex, sample_time_s: float) -> complex:
    """Return the pole ln(z) / T of continuous time [1/s], z above the real axis."""
    return complex(0.5 * np.log(squared(z)), angle_of(z)) * (1.0 / sample_time_s)


@inlined
def residue(b: FloatArray, nk: int, z: ComplexArray, i: int) -> complex:
    """Return what stands over 1 - z_i q^-1 in the partial fractions of B / A."""
    q = ratio(1.0 + 0.0j, z[i])
    numerator = 0.0 + 0.0j
    for j in range(b.shape[0] - 1, -1, -1):
        numerator = numerator * q + b[j]
    for _ in range(nk):
        numerator *= q
    for j in range(z.shape[0]):
        if j != i:
            numerator = ratio(numerator, 1.0 - z[j] * q)
    return complex(numerator.real, numerator.imag)


@inlined
def height(b: FloatArray, nk: int, z: ComplexArray, i: int) -> float:
    """Return |residue of B / A at pole i| / distance of the pole from the unit circle."""
    return float(np.sqrt(squared(residue(b, nk, z, i))) / max(1.0 - np.sqrt(squared(z[i])), 1e-12))


@compiled
def dominant(
    theta: FloatArray, na: int, nk: int, sample_time_s: float, band_hz: FloatArray, z: ComplexArray, mode: FloatArray
) -> int:
    """Find the dominant lightly damped mode, as ``modes.resonance`` does."""
    best = -1
    if not find_poles(theta[:na], z):
        return best
    for i in range(na):
        if z[i].imag <= 1e-9 * np.sqrt(squared(z[i])):  # a real pole does not oscillate, at whatever sampled frequency
            continue
        s = continuous(z[i], sample_time_s)
        magnitude = np.sqrt(squared(s))
        frequency_hz = magnitude / (2.0 * np.pi)
        damping = -s.real / magnitude
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
    s = continuous(z[i], sample_time_s)
    magnitude = np.sqrt(squared(s))
    power = 1.0 + 0.0j
    for k in range(n - 1, -1, -1):
        ds = -ratio(power, slope * z[i] * sample_time_s)
        along = (s.real * ds.real + s.imag * ds.imag) / magnitude
        frequency[k] = along / (2.0 * np.pi)
        damping[k] = -ds.real / magnitude + s.real * along / (magnitude * magnitude)
        power *= z[i]


@compiled
def pass_torque(u: float, pole: complex, through: FloatArray) -> None:
    """Pass a torque's step through the resonance's pole, once and twice, as its sensitivity needs it."""
    once = pole * complex(through[ONCE_RE], through[ONCE_IM]) + (u - through[LAST])
    twice = pole * complex(through[TWICE_RE], through[TWICE_IM]) + once
    through[ONCE_RE], through[ONCE_IM], through[TWICE_RE], through[TWICE_IM] = (
        once.real,
        once.imag,
        twice.real,
        twice.imag,
    )
    through[LAST] = u


@compiled
def weight_of(pole: complex, residue: complex, damping: float, sample_time_s: float) -> complex:
    """Return rho dp/df, in the units of the output per Hz and torque."""
    turning = complex(-damping, np.sqrt(1.0 - damping * damping)) * (2.0 * np.pi * sample_time_s)
    return complex(residue * pole * turning)


@compiled
def sensitivity(weight: complex, through: FloatArray) -> float:
    """Return psi of the next sample's steps, from the torques passed so far."""
    return float(2.0 * (weight.real * through[TWICE_RE] - weight.imag * through[TWICE_IM]))


@compiled
def of_steps(pole: complex) -> float:
    """Return |1 - q^-1|^2 at the frequency of a pole: what taking steps makes of a density there."""
    return float(2.0 * (1.0 - pole.real / np.sqrt(squared(pole))))


@compiled
def output_density(psi: float, pole: complex, half_width_hz: float) -> float:
    """Return a sample of the density at its peak of what the torque makes of the output [output unit squared]."""
    r = np.sqrt(squared(pole))
    over = half_width_hz * psi
    return float(over * over * (1.0 + r) / (1.0 - r) / of_steps(pole))
