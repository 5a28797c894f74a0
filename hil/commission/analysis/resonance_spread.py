"""How well one recording determines the resonance: the model's covariance carried over to frequency and damping."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from estimator.identification.linear_model import LinearModel
from estimator.identification.modes.modes import Mode, resonance
from estimator.signals.record import FloatArray

if TYPE_CHECKING:
    from estimator.identification.offline.fits import LinearFit

STEP = 1e-3
"""Step of the differences, in standard deviations of each direction of theta."""


@dataclass(frozen=True, slots=True)
class ResonanceSpread:
    """The resonance and the standard deviations of its frequency and damping, relative to each."""

    mode: Mode
    frequency_std: float
    damping_std: float

    def scaled(self, factor: float) -> ResonanceSpread:
        """Return the same with standard deviations so many times as large."""
        return ResonanceSpread(self.mode, factor * self.frequency_std, factor * self.damping_std)


def resonance_spread(fit: LinearFit, band_hz: tuple[float, float]) -> ResonanceSpread | None:
    """Return the resonance of a fit and how well it is known; None without one in the band.

    First order: differences along the principal directions of the covariance of theta, ``sigma^2 (J'J)^-1``.
    """
    mode = resonance(fit.model, band_hz)
    if mode is None:
        return None
    sizes, directions = np.linalg.eigh(fit.covariance)
    gradients = [
        _change(fit.model, mode, np.sqrt(max(size, 0.0)) * v) for size, v in zip(sizes, directions.T, strict=True)
    ]
    frequency, damping = np.sqrt(np.sum(np.array(gradients) ** 2, axis=0))
    return ResonanceSpread(mode, float(frequency) / mode.frequency_hz, float(damping) / abs(mode.damping))


def _change(model: LinearModel, mode: Mode, step: FloatArray) -> tuple[float, float]:
    """Return the change of frequency and damping for a change of theta, by a small part of it."""
    moved = LinearModel.from_theta(model.theta + STEP * step, model.orders, model.sample_time_s)
    near = (0.5 * mode.frequency_hz, 2.0 * mode.frequency_hz)
    after = resonance(moved, near)
    if after is None:
        return 0.0, 0.0
    return (after.frequency_hz - mode.frequency_hz) / STEP, (after.damping - mode.damping) / STEP
