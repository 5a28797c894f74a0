"""Poles and zeros with confidence ellipses, and what cancels; resonance and damping with intervals.

The covariance of theta becomes one of (Re z, Im z) through :mod:`estimator.identification.modes.roots`, and a
chi-square quantile of it the ellipse. Frequency and damping follow through ``s = ln(z) / T``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from estimator.errors import BadShape
from estimator.identification.linear_model import ComplexArray, LinearModel
from estimator.identification.modes.cancellation import Cancellation, cancellations
from estimator.identification.modes.modes import Mode, continuous, modes, resonance
from estimator.identification.modes.propagate import CONFIDENCE, Uncertain, square_root
from estimator.identification.modes.roots import Roots, covariance_of, pole_roots, zero_roots
from estimator.signals.record import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class UncertainRoot:
    """A pole or zero in z.

    Attributes
    ----------
    value : complex
    covariance : ndarray, shape (2, 2)
        Of its real and imaginary part; the second row is 0 for a real root.
    """

    value: complex
    covariance: FloatArray

    def ellipse(self, confidence: float = CONFIDENCE, points: int = 73) -> ComplexArray:
        """Return the outline of the confidence region, closed, shape (points,); a segment for a real root."""
        freedom = 2 if self.value.imag != 0.0 else 1
        radius = np.sqrt(chi2.ppf(confidence, freedom))
        around = np.linspace(0.0, 2.0 * np.pi, points)
        offset = radius * square_root(self.covariance) @ np.array([np.cos(around), np.sin(around)])
        return np.asarray(self.value + offset[0] + 1j * offset[1], dtype=np.complex128)


@dataclass(frozen=True, slots=True, eq=False)
class PoleZeroMap:
    """Every pole and zero of a model with its ellipse, and what cancels."""

    poles: tuple[UncertainRoot, ...]
    zeros: tuple[UncertainRoot, ...]
    cancellations: tuple[Cancellation, ...]


@dataclass(frozen=True, slots=True)
class UncertainMode:
    """Natural frequency [Hz] and damping ratio with their standard deviations and 95 % intervals."""

    frequency_hz: Uncertain
    damping: Uncertain

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
    """Return every pole and zero with its uncertainty, and the pairs that cancel.

    Parameters
    ----------
    model : LinearModel
        Estimate.
    covariance : ndarray, shape (na+nb, na+nb)
        Of theta.
    confidence : float
        At which a pole and a zero count as different.

    Raises
    ------
    BadShape
        If the covariance is not that of theta.
    """
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
    """Return the oscillating pairs of poles with intervals, the one with the highest peak first.

    Raises
    ------
    BadShape
        If the covariance is not that of theta.
    """
    P = _checked(model, covariance)
    return tuple(_uncertain_mode(model, P, mode) for mode in modes(model))


def uncertain_resonance(
    model: LinearModel, covariance: FloatArray, band_hz: tuple[float, float] = (2.0, 25.0)
) -> UncertainMode | None:
    """Return the dominant lightly damped pair of poles in a band [Hz] with its intervals; None if there is none.

    Raises
    ------
    BadShape
        If the covariance is not that of theta.
    """
    P = _checked(model, covariance)
    mode = resonance(model, band_hz)
    return None if mode is None else _uncertain_mode(model, P, mode)


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
