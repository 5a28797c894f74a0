"""From poles to what an engineer means: natural frequency, damping, and which of them is the resonance.

A pole z of a model sampled with period T belongs to the continuous-time pole ``s = ln(z) / T``; it is the
matched one as long as the mode lies below the Nyquist frequency. Natural frequency ``|s| / 2 pi``, damping
ratio ``-Re s / |s|``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from estimator.errors import BadShape
from estimator.identification.linear_model import ComplexArray, LinearModel
from estimator.signals.record import FloatArray

LIGHTLY_DAMPED = 0.5
"""Damping ratio from which on a pair is no resonance: beyond 0.5 its peak rises less than 15 % above 1."""

CONFIDENCE = 0.95  # of every interval and ellipse that does not say otherwise
OUTLINE = 73  # points of an ellipse: every 5 degrees, the first one twice

QUANTILE = NormalDist().inv_cdf(0.5 + CONFIDENCE / 2.0)
"""Half width of such an interval in standard deviations: 1.96."""

SHORT = 0.5  # reach of an interval to either side, against the value, up to which a number is known
STEP = 0.01  # of the difference quotient, in standard deviations

FAR = 1e6
"""Squared distance, in units of its uncertainty, beyond which none is farther: a thousand standard deviations."""


@dataclass(frozen=True, slots=True)
class Mode:
    """One oscillating pair of poles (or zeros).

    Attributes
    ----------
    frequency_hz : float
        Natural frequency, ``|s| / 2 pi`` [Hz].
    damping : float
        Damping ratio.
    height : float
        Peak of the pair's own share of the frequency response [output unit per input unit]; 0 for zeros.
    """

    frequency_hz: float
    damping: float
    height: float = 0.0


def continuous(z: ComplexArray, sample_time_s: float) -> ComplexArray:
    """Map poles or zeros in z to s [1/s], shape as given; z = 0 goes to minus infinity."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(z.astype(np.complex128)) / sample_time_s, dtype=np.complex128)


def _oscillating(z: ComplexArray) -> ComplexArray:
    """Keep one of each conjugate pair; a real pole does not oscillate, at whatever sampled frequency."""
    return z[z.imag > 0.0]


def _mode(z: complex, sample_time_s: float, height: float = 0.0) -> Mode:
    s = complex(continuous(np.array([z]), sample_time_s)[0])
    return Mode(abs(s) / (2.0 * np.pi), -s.real / abs(s), height)


def _height(model: LinearModel, z: complex) -> float:
    """Return |residue of B / A at the pole| / distance of the pole from the unit circle."""
    poles = model.poles
    others = poles[np.argsort(np.abs(poles - z))[1:]]
    numerator = np.polynomial.polynomial.polyval(1.0 / z, model.B)
    residue = numerator / np.prod(1.0 - others / z)
    return float(abs(residue) / max(1.0 - abs(z), 1e-12))


def modes(model: LinearModel) -> tuple[Mode, ...]:
    """Return the oscillating pairs of poles, the one with the highest peak first."""
    found = [_mode(z, model.sample_time_s, _height(model, z)) for z in _oscillating(model.poles).tolist()]
    return tuple(sorted(found, key=lambda mode: -mode.height))


def resonance(model: LinearModel, band_hz: tuple[float, float] = (2.0, 25.0)) -> Mode | None:
    """Return the dominant lightly damped pair of poles in a band.

    Parameters
    ----------
    model : LinearModel
        The model.
    band_hz : tuple of float
        Lowest and highest natural frequency looked at [Hz]. The paper names 5 to 50 Hz for drivelines in
        general; with a period of 20 ms the band ends at 25 Hz.

    Returns
    -------
    Mode or None
        None if no pair in the band has a damping ratio below 0.5.
    """
    low, high = band_hz
    for mode in modes(model):
        if low <= mode.frequency_hz <= high and abs(mode.damping) < LIGHTLY_DAMPED:
            return mode
    return None


def two_mass_resonance(J_M: float, J_L: float, k: float, c: float, b_M: float, b_L: float) -> Mode | None:
    """Return the mode of a two-mass model [kg m^2, Nm/rad, Nm s/rad]; None if it does not oscillate."""
    A = np.array(
        [
            [-(c + b_M) / J_M, c / J_M, -k / J_M],
            [c / J_L, -(c + b_L) / J_L, k / J_L],
            [1.0, -1.0, 0.0],
        ]
    )
    pairs = _oscillating(np.linalg.eigvals(A).astype(np.complex128))
    if pairs.shape[0] == 0:
        return None
    s = complex(pairs[0])
    return Mode(abs(s) / (2.0 * np.pi), -s.real / abs(s))


@dataclass(frozen=True, slots=True)
class Uncertain:
    """A number and its standard deviation; infinite where the data say nothing of it."""

    value: float  # the estimate
    std: float  # standard deviation, in the unit of the value
    interval: tuple[float, float] | None = None  # interval of 95 %, where it is not that of a normal distribution

    @property
    def ci95(self) -> tuple[float, float]:
        """Interval that holds the truth with 95 % probability."""
        return self.interval or (self.value - QUANTILE * self.std, self.value + QUANTILE * self.std)

    @property
    def is_determined(self) -> bool:
        """Tell whether the interval is short against the value to either side: then size and sign are known."""
        low, high = self.ci95
        return max(high - self.value, self.value - low) <= SHORT * abs(self.value)

    def covers(self, truth: float) -> bool:
        """Tell whether the interval holds a value."""
        low, high = self.ci95
        return low <= truth <= high


def square_root(covariance: FloatArray) -> FloatArray:
    """Return S with ``S S^T = P``, its columns along the principal axes; rounding below zero counts as zero."""
    variances, axes = np.linalg.eigh(0.5 * (covariance + covariance.T))
    return np.asarray(axes * np.sqrt(np.maximum(variances, 0.0)), dtype=np.float64)


def propagate(
    function: Callable[[FloatArray], FloatArray], parameters: FloatArray, covariance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return a function's values (M,) and their covariance (M, M), linearised along the axes of the covariance."""
    axes = square_root(covariance).T
    value = function(parameters)
    slopes = [(function(parameters + STEP * axis) - function(parameters - STEP * axis)) / (2.0 * STEP) for axis in axes]
    G = np.array(slopes).reshape(axes.shape[0], value.shape[0])
    return value, G.T @ G


@dataclass(frozen=True, slots=True, eq=False)
class Roots:
    """Roots, shape (n,), and their derivatives by theta, shape (n, na + nb), complex."""

    values: ComplexArray  # in the z plane
    slopes: ComplexArray  # d root / d theta


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
    """Return the poles of a model and their derivatives."""
    return _roots(model.A, 1, 0, model.orders.n_parameters)


def zero_roots(model: LinearModel) -> Roots:
    """Return the zeros of a model and their derivatives."""
    return _roots(np.array(model.b), 0, len(model.a), model.orders.n_parameters)


def covariance_of(slope: ComplexArray, P: FloatArray) -> FloatArray:
    """Return the covariance of (Re, Im) of a complex number with this derivative; infinite at a double root."""
    if not np.isfinite(slope).all():
        return np.diag([np.inf, np.inf])
    G = np.array([slope.real, slope.imag])
    return np.asarray(G @ P @ G.T, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Cancellation:
    """A pole and a zero that the data can't distinguish."""

    pole: complex  # in z
    zero: complex  # in the z plane
    p_value: float  # probability of a distance at least this large if they were one

    @property
    def statement(self) -> str:
        """What it means, in a sentence."""
        kind = "pair" if self.pole.imag else "pole"
        return (
            f"The {kind} at {self.pole:.3f} and the zero at {self.zero:.3f} can't be distinguished "
            f"(p = {self.p_value:.2g}): the data do not need this {kind}."
        )


def cancellations(poles: Roots, zeros: Roots, P: FloatArray, confidence: float) -> tuple[Cancellation, ...]:
    """Pair poles and zeros of one kind, closest in units of their uncertainty first, each at most once."""
    from scipy.optimize import linear_sum_assignment  # both take a second to import, and on line nothing is paired
    from scipy.special import chdtrc

    found = []
    for imaginary, freedom in ((False, 1), (True, 2)):
        p_at, z_at = (
            np.flatnonzero(roots.values.imag > 0 if imaginary else roots.values.imag == 0) for roots in (poles, zeros)
        )
        distance = np.array([[_distance(poles, int(i), zeros, int(j), P, freedom) for j in z_at] for i in p_at])
        for row, column in zip(*linear_sum_assignment(distance.reshape(len(p_at), len(z_at))), strict=True):
            p_value = float(chdtrc(freedom, distance[row, column]))
            if p_value > 1.0 - confidence:
                found.append(
                    Cancellation(complex(poles.values[p_at[row]]), complex(zeros.values[z_at[column]]), p_value)
                )
    return tuple(found)


def _distance(poles: Roots, i: int, zeros: Roots, j: int, P: FloatArray, freedom: int) -> float:
    """Return the squared distance of a pole and a zero in units of its own uncertainty."""
    difference = zeros.values[j] - poles.values[i]
    spread = covariance_of(zeros.slopes[j] - poles.slopes[i], P)[:freedom, :freedom]
    d = np.array([difference.real, difference.imag])[:freedom]
    if not np.isfinite(spread).all():
        return 0.0
    variances, axes = np.linalg.eigh(spread)
    floor = max(float(variances[-1]) * np.finfo(np.float64).eps, np.finfo(np.float64).tiny)
    return float(min(np.sum((axes.T @ d) ** 2 / np.maximum(variances, floor)), FAR))


@dataclass(frozen=True, slots=True, eq=False)
class UncertainRoot:
    """A pole or zero in z."""

    value: complex  # in the z plane
    covariance: FloatArray  # of its real and imaginary part

    def ellipse(self) -> ComplexArray:
        """Return the outline of the 95 % region, closed, shape (OUTLINE,); a segment for a real root."""
        freedom = 2 if self.value.imag != 0.0 else 1
        from scipy.special import chdtri  # see above

        radius = np.sqrt(chdtri(freedom, 1.0 - CONFIDENCE))
        around = np.linspace(0.0, 2.0 * np.pi, OUTLINE)
        offset = radius * square_root(self.covariance) @ np.array([np.cos(around), np.sin(around)])
        return np.asarray(self.value + offset[0] + 1j * offset[1], dtype=np.complex128)


@dataclass(frozen=True, slots=True, eq=False)
class PoleZeroMap:
    """Every pole and zero of a model with its ellipse, and what cancels."""

    poles: tuple[UncertainRoot, ...]  # of A
    zeros: tuple[UncertainRoot, ...]  # of B
    cancellations: tuple[Cancellation, ...]  # pairs of both


@dataclass(frozen=True, slots=True)
class UncertainMode:
    """Natural frequency [Hz] and damping ratio with their standard deviations and 95 % intervals."""

    frequency_hz: Uncertain  # undamped natural frequency [Hz]
    damping: Uncertain  # damping ratio

    @property
    def mode(self) -> Mode:
        """The estimate alone."""
        return Mode(self.frequency_hz.value, self.damping.value)


def _checked(model: LinearModel, covariance: FloatArray) -> FloatArray:
    n = model.orders.n_parameters
    if covariance.shape != (n, n):
        raise BadShape(
            f"linear model: its covariance has shape {covariance.shape}, expected ({n}, {n}) for {n} coefficients. "
            "Give the covariance of theta of the same fit."
        )
    return covariance


def pole_zero_map(model: LinearModel, covariance: FloatArray, confidence: float = CONFIDENCE) -> PoleZeroMap:
    """Return every pole and zero with its uncertainty, and the pairs that cancel."""
    P = _checked(model, covariance)
    poles, zeros = pole_roots(model), zero_roots(model)
    return PoleZeroMap(
        poles=tuple(_uncertain_roots(poles, P)),
        zeros=tuple(_uncertain_roots(zeros, P)),
        cancellations=cancellations(poles, zeros, P, confidence),
    )


def _uncertain_roots(roots: Roots, P: FloatArray) -> list[UncertainRoot]:
    return [
        UncertainRoot(complex(z), covariance_of(slope, P)) for z, slope in zip(roots.values, roots.slopes, strict=True)
    ]


def uncertain_modes(model: LinearModel, covariance: FloatArray) -> tuple[UncertainMode, ...]:
    """Return the oscillating pairs of poles with intervals, the one with the highest peak first."""
    P = _checked(model, covariance)
    return tuple(_uncertain_mode(model, P, mode) for mode in modes(model))


def _uncertain_mode(model: LinearModel, P: FloatArray, mode: Mode) -> UncertainMode:
    """Frequency and damping of the pair that is this mode; s = ln(z) / T, so ds = dz / (z T)."""
    roots = pole_roots(model)
    s = continuous(roots.values, model.sample_time_s)
    at = int(np.argmin(np.where(roots.values.imag > 0, np.abs(np.abs(s) / (2.0 * np.pi) - mode.frequency_hz), np.inf)))
    slope = roots.slopes[at] / (roots.values[at] * model.sample_time_s)
    spread = covariance_of(slope, P)
    size = abs(s[at])
    direction = np.array([s[at].real, s[at].imag]) / size
    to_frequency = direction / (2.0 * np.pi)  # d |s| = Re(conj(s) ds) / |s|
    to_damping = np.array([-1.0 + direction[0] ** 2, direction[0] * direction[1]]) / size  # of -Re s / |s|
    deviations = [_deviation(gradient, spread) for gradient in (to_frequency, to_damping)]
    return UncertainMode(Uncertain(mode.frequency_hz, deviations[0]), Uncertain(mode.damping, deviations[1]))


def _deviation(gradient: FloatArray, covariance: FloatArray) -> float:
    if not np.isfinite(covariance).all():
        return math.inf
    return math.sqrt(max(float(gradient @ covariance @ gradient), 0.0))
