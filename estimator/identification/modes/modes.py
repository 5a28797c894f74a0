"""From poles to what an engineer means: natural frequency, damping, and which of them is the resonance.

A pole z of a model sampled with period T belongs to the continuous-time pole ``s = ln(z) / T``; it is the
matched one as long as the mode lies below the Nyquist frequency. Natural frequency ``|s| / 2 pi``, damping
ratio ``-Re s / |s|``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimator.identification.linear_model import ComplexArray, LinearModel

LIGHTLY_DAMPED = 0.5
"""Damping ratio from which on a pair is no resonance: beyond 0.5 its peak rises less than 15 % above 1."""


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
