"""The paper's chain from a recording to a model: one pure function and its settings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimator.errors import NotExciting
from estimator.identification.linear_model import LinearModel
from estimator.identification.modes.modes import Mode, continuous, resonance
from estimator.identification.offline.fits import LinearFit, fit_output_error
from estimator.identification.online.recursive import Estimate, Trajectory
from estimator.identification.settings import FilterPart, Settings
from estimator.identification.spectral import SpectralEstimate, spectral_estimate
from estimator.signals.decimate import decimate
from estimator.signals.record import FloatArray, Record


@dataclass(frozen=True, slots=True, eq=False)
class Identification:
    """Everything identified from one recording.

    Attributes
    ----------
    name : str
        The recording.
    data : Record
        What the on-line model was fitted to: high-passed and decimated.
    offline : Record
        What the off-line models were fitted to: high-passed, at the recording's own period by default.
    L : ndarray
        Observation filter's denominator.
    batch : LinearFit
        Off-line output-error model.
    trajectory : Trajectory
        Every recursive estimate.
    online : LinearModel
        The last of them as a model.
    spectral : SpectralEstimate or None
        None if the mask leaves too few unbroken segments of any useful length.
    no_spectral : str
        Why there is none.
    batch_resonance, online_resonance : Mode or None
        Dominant lightly damped mode of each.
    """

    name: str
    data: Record
    offline: Record
    L: FloatArray
    batch: LinearFit
    trajectory: Trajectory
    online: LinearModel
    spectral: SpectralEstimate | None
    no_spectral: str
    batch_resonance: Mode | None
    online_resonance: Mode | None

    @property
    def estimate(self) -> Estimate:
        """The last recursive estimate, with its status."""
        return self.trajectory[len(self.trajectory) - 1]


def observation_filter(model: LinearModel, part: FilterPart, lowest_hz: float) -> FloatArray:
    """Return L for a model: A, or its oscillating poles above a frequency [Hz]; leading 1."""
    if part is FilterPart.ALL:
        return model.A
    poles = model.poles
    natural_hz = np.abs(continuous(poles, model.sample_time_s)) / (2.0 * np.pi)
    kept = poles[(poles.imag != 0.0) & (natural_hz >= lowest_hz)]
    return np.atleast_1d(np.real(np.poly(kept))).astype(np.float64)


def identify(record: Record, settings: Settings | None = None) -> Identification:
    """Identify a driveline from one recording.

    Parameters
    ----------
    record : Record
        Total torque in, speed (or whatever the output is) out; not changed.
    settings : Settings, optional
        The paper's by default.

    Returns
    -------
    Identification
        Batch, recursive and spectral estimate and the resonance.

    Raises
    ------
    BadSetting
        If the recording's sampling period does not divide that of the models.
    NotExciting
        If the recording can't determine a model of these orders, naming the parameters.
    """
    settings = Settings() if settings is None else settings
    data = decimate(record, settings.factor(record), settings.high_pass_hz)
    offline = settings.offline(record)
    batch = fit_output_error(offline, settings.orders)
    observer = (
        batch if settings.offline_sample_time_s == settings.sample_time_s else fit_output_error(data, settings.orders)
    )
    L = observation_filter(observer.model, settings.filter_part, settings.band_hz[0])
    estimator = settings.estimator(L)
    n = _samples_holding(data, settings.samples)
    trajectory = estimator.run(data.total_torque_nm[:n], data.output[:n], data.okay[:n])
    online = estimator.model(data.sample_time_s)
    spectral, no_spectral = _spectral(offline, settings.segment_s)
    return Identification(
        name=record.name,
        data=data,
        offline=offline,
        L=L,
        batch=batch,
        trajectory=trajectory,
        online=online,
        spectral=spectral,
        no_spectral=no_spectral,
        batch_resonance=resonance(batch.model, settings.band_hz),
        online_resonance=resonance(online, settings.band_hz),
    )


def _samples_holding(data: Record, good: int | None) -> int:
    """Return how many samples from the start hold that many good ones; all if there are fewer."""
    if good is None:
        return int(data.okay.shape[0])
    return int(np.searchsorted(np.cumsum(data.okay), good)) + 1


def _spectral(data: Record, segment_s: float) -> tuple[SpectralEstimate | None, str]:
    try:
        return spectral_estimate(data, round(segment_s / data.sample_time_s)), ""
    except NotExciting as error:
        return None, str(error)
