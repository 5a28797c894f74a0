"""The figures behind the figures: resonance and damping on line, off line and true, and how far they are apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimator.identification.linear_model import ComplexArray
from estimator.identification.modes.modes import Mode
from hil.figures.local_model import LocalModel, decibels, unbroken

NOT_KNOWN = float("nan")

AGREEMENT_DB = 3.0
"""On-line model and spectral estimate agree where they differ by no more: a factor of 1.4."""


@dataclass(frozen=True, slots=True)
class Row:
    """One experiment; NaN where there is no such value.

    Attributes
    ----------
    name
        The recording.
    online_hz, offline_hz, reference_hz
        Natural frequency of the resonance [Hz].
    online_damping, offline_damping, reference_damping
        Its damping ratio.
    offline_db, spectral_db, reference_db
        Largest difference of the on-line frequency response from the off-line model's, the spectral estimate and the
        reference, in the band around the resonance where the coherence is above 0.9 [dB].
    agrees_hz
        Unbroken band around the resonance in which on-line model and spectral estimate agree within 3 dB [Hz]; None
        where one of them is missing.
    fit_percent
        Of the off-line model in free run.
    status
        Of the on-line estimate.
    """

    name: str
    online_hz: float
    offline_hz: float
    reference_hz: float
    online_damping: float
    offline_damping: float
    reference_damping: float
    offline_db: float
    spectral_db: float
    agrees_hz: tuple[float, float] | None
    reference_db: float
    fit_percent: float
    status: str

    def error(self, what: str, how: str) -> float:
        """Return the relative error of ``what`` (hz, damping) as found ``how`` (online, offline) to the reference."""
        reference: float = getattr(self, f"reference_{what}")
        return getattr(self, f"{how}_{what}") / reference - 1.0 if reference else NOT_KNOWN


def row_of(model: LocalModel) -> Row:
    """Return the figures of one experiment."""
    found = model.found
    online_hz, online_damping = _of(found.online_resonance)
    offline_hz, offline_damping = _of(found.batch_resonance)
    reference_hz, reference_damping = _of(model.reference_mode)
    offline_db, spectral_db, reference_db = _differences_db(model)
    return Row(
        name=model.name,
        online_hz=online_hz,
        offline_hz=offline_hz,
        reference_hz=reference_hz,
        online_damping=online_damping,
        offline_damping=offline_damping,
        reference_damping=reference_damping,
        offline_db=offline_db,
        spectral_db=spectral_db,
        agrees_hz=_agreement(model),
        reference_db=reference_db,
        fit_percent=found.batch.fit_percent,
        status=found.estimate.status.value,
    )


def _of(mode: Mode | None) -> tuple[float, float]:
    return (NOT_KNOWN, NOT_KNOWN) if mode is None else (mode.frequency_hz, mode.damping)


def _differences_db(model: LocalModel) -> tuple[float, float, float]:
    f = model.coherent_hz
    spectral = model.found.spectral
    if f.size == 0 or spectral is None:
        return (NOT_KNOWN,) * 3
    online = model.online.response(f)
    seen = spectral.response[np.isin(spectral.frequency_hz, f)]
    return (
        _largest_db(online, model.found.batch.model.response(f)),
        _largest_db(online, seen),
        _largest_db(online, model.reference_response(f)),
    )


def _agreement(model: LocalModel) -> tuple[float, float] | None:
    """Return the unbroken band around the resonance in which on-line model and spectral estimate agree [Hz]."""
    spectral, mode = model.found.spectral, model.found.online_resonance
    if spectral is None or mode is None:
        return None
    f = spectral.frequency_hz[spectral.frequency_hz <= 0.5 / model.online.sample_time_s]
    apart = np.abs(decibels(model.online.response(f)) - decibels(spectral.response[: f.size]))
    at = int(np.argmin(np.abs(f - mode.frequency_hz)))
    inside = f[unbroken(apart <= AGREEMENT_DB, at)]
    return (float(inside[0]), float(inside[-1])) if inside.size else None


def _largest_db(response: ComplexArray, other: ComplexArray | None) -> float:
    return NOT_KNOWN if other is None else float(np.abs(decibels(response) - decibels(other)).max())


def mode_text(mode: Mode | None) -> str:
    """Return a resonance in words, for a caption."""
    return "no resonance" if mode is None else f"{mode.frequency_hz:.2f} Hz, ζ {mode.damping:.4f}"
