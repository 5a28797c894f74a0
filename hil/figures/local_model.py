"""What a figure is drawn from: one experiment, what was identified from it, and the truth where it is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.identification.identify import Identification
from estimator.identification.linear_model import ComplexArray, LinearModel
from estimator.identification.modes.modes import Mode
from estimator.identification.modes.reduced import third_order
from estimator.physics.model import DrivelineModel, Structure
from estimator.signals.record import FloatArray, Record
from hil.figures.line import TwoMassLine

COHERENT = 0.9
"""Coherence from which on a spectral estimate is held against a model."""

HALF_TURN_DEG = 180.0

TRUTH, MODEL_FILE = "truth", "model file"
"""Names of what there is to compare with."""


@dataclass(frozen=True, slots=True)
class Reference:
    """A driveline to compare with: the simulation's own (``truth``), or what a model file expects (``model file``)."""

    name: str
    line: TwoMassLine


@dataclass(frozen=True, slots=True)
class LocalModel:
    """One experiment, as the paper calls what comes of it.

    Attributes
    ----------
    record
        As it was recorded, at 10 ms in the paper.
    found
        On-line, off-line and spectral estimate of it.
    reference
        What to draw next to them.
    """

    record: Record
    found: Identification
    reference: Reference | None = None

    @classmethod
    def with_expected(cls, record: Record, found: Identification, expected: DrivelineModel | None) -> LocalModel:
        """Compare with what a model file expects; with nothing where that is no two-mass drive."""
        if expected is None or expected.structure is not Structure.TWO_MASS:
            return cls(record, found)
        return cls(record, found, Reference(MODEL_FILE, TwoMassLine.of(expected.values())))

    @property
    def name(self) -> str:
        """The recording's."""
        return self.record.name

    @property
    def online(self) -> LinearModel:
        """The model that OEFO arrived at."""
        return self.found.online

    @property
    def reference_mode(self) -> Mode | None:
        """The reference's resonance."""
        return None if self.reference is None else self.reference.line.resonance

    def reference_response(self, frequency_hz: FloatArray) -> ComplexArray | None:
        """Return the reference's response to a torque held as the recording's is, shape (M,)."""
        if self.reference is None:
            return None
        return self.reference.line.response(frequency_hz, self.record.sample_time_s)

    @property
    def third_order(self) -> LinearModel | None:
        """The on-line model's third-order equivalent; None where it is unstable and has none."""
        return third_order(self.online).model if self.online.is_stable else None

    @property
    def coherent_hz(self) -> FloatArray:
        """Frequencies of the spectral estimate around the resonance with a coherence above 0.9, shape (K,).

        All of one stretch; none where there is no resonance, no spectral estimate, or no coherence.
        """
        spectral, mode = self.found.spectral, self.found.batch_resonance
        if spectral is None or mode is None:
            return np.empty(0)
        f = spectral.frequency_hz
        at = int(np.argmin(np.abs(f - mode.frequency_hz)))
        inside = unbroken(spectral.coherence > COHERENT, at)
        return f[inside]


def unbroken(is_in: NDArray[np.bool_], at: int) -> NDArray[np.bool_]:
    """Keep the unbroken stretch of True that holds an index, shape as given; all False where it is not True there."""
    kept = np.zeros_like(is_in)
    if is_in[at]:
        outside = np.flatnonzero(~is_in)
        low = outside[outside < at].max(initial=-1) + 1
        high = outside[outside > at].min(initial=is_in.size)
        kept[low:high] = True
    return kept


def decibels(response: ComplexArray) -> FloatArray:
    """Return 20 log10 of a magnitude [dB]."""
    with np.errstate(divide="ignore"):
        return np.asarray(20.0 * np.log10(np.abs(response)), dtype=np.float64)


def degrees(response: ComplexArray) -> FloatArray:
    """Return the phase from -180 to 180 [degree]; NaN where a line would jump from one end to the other."""
    angle = np.rad2deg(np.angle(response))
    jumps = np.abs(np.diff(angle, append=angle[-1:])) > HALF_TURN_DEG
    return np.asarray(np.where(jumps, np.nan, angle), dtype=np.float64)
