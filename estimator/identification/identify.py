"""The paper's chain from a recording to a model: one pure function and its settings.

1. Both signals lose their slow part by the same high-pass and go from 10 to 20 ms through the same low-pass.
2. A batch output-error model of these gives the observation filter L.
3. OEFO runs through N = 1024 samples: the on-line model.
4. Off line, at the recording's own period, at which the torque was held: the output-error model and the spectral
   estimate of all samples.
5. Poles become natural frequency and damping.

The filter L. The paper takes all of A_hat. Where the load varies strongly, the batch model puts one or two
poles within 0.001 of z = 1, and 1 / L then drowns Phi in the slow part that the high-pass had just removed.
By default L therefore holds the oscillating poles alone (:attr:`FilterPart.OSCILLATING`); the paper's choice
is :attr:`FilterPart.ALL`. In 24 simulated cruises each, the worst error of the damping was 1.5 % against 9.6
% with the load of the tests, and with twice its variation 2.1 % against more than 15 % in 13 of the 24.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.errors import BadModel, NotExciting
from estimator.identification.best import BestEstimate, ModelVerdict, best_estimate
from estimator.identification.chain import OnlineChain, OnlineTrajectory
from estimator.identification.linear_model import LinearModel
from estimator.identification.modes.modes import Mode, PoleZeroMap, UncertainMode, continuous, pole_zero_map, resonance
from estimator.identification.modes.physical import PhysicalEstimate, physical_parameters
from estimator.identification.modes.reduced import Reduced, third_order
from estimator.identification.offline.fits import LinearFit, fit_output_error, free_run, white
from estimator.identification.offline.validation import Feedback, Validation, validate
from estimator.identification.online.ekf import TwoMass
from estimator.identification.online.estimators import Entry, Feed, Setup
from estimator.identification.online.recursive import Estimate, Status, Trajectory
from estimator.identification.settings import SAMPLES_PER_PARAMETER, FilterPart, Settings, require_excitation
from estimator.identification.spectral import SpectralEstimate, spectral_estimate
from estimator.signals.decimate import decimate
from estimator.signals.record import FloatArray, Record

VALUES_PER_WIDTH = 4
"""Frequencies of the spectral estimate within its resolution: the eye follows a curve between them."""


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
    batch_resonance: Mode | None  # of the off-line output-error model; None where it has none
    online_resonance: Mode | None  # of the recursive estimate at its end; None where it has none

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


def require_determined(record: Record, settings: Settings) -> None:
    """Refuse a recording that can't determine the models of these settings, before anything is fitted."""
    for data in (settings.offline(record), decimate(record, settings.factor(record), settings.high_pass_hz)):
        require_excitation(data.name, data.total_torque_nm, data.output, data.okay, settings.orders)


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
    spectral, no_spectral = _spectral(offline)
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
    if good is None:
        return int(data.okay.shape[0])
    return int(np.searchsorted(np.cumsum(data.okay), good)) + 1


def _spectral(data: Record) -> tuple[SpectralEstimate | None, str]:
    try:
        return spectral_estimate(data, VALUES_PER_WIDTH), ""
    except NotExciting as error:
        return None, str(error)


@dataclass(frozen=True, slots=True)
class Compared:
    """What one estimator made of one recording."""

    recording: str  # names
    estimator: str  # name as `--estimator` takes it
    resonance: Mode | None  # of its last model
    fit_percent: float  # of its free run, 100 (1 - NRMSE) [%]
    status: Status  # of its last estimate
    reason: str = ""  # why it has that status and what to do


def compare(
    record: Record, found: Identification, settings: Settings, name: str, entry: Entry, start: TwoMass | None = None
) -> Compared:
    """Run an estimator through the stretch of time the recursive estimate of an identification was made from."""
    raw = entry.feed is Feed.RAW
    fed = record if raw else found.data
    n = len(found.trajectory) * (settings.factor(record) if raw else 1)
    setup = Setup(
        orders=settings.orders,
        sample_time_s=fed.sample_time_s,
        adaptation=settings.adaptation,
        L=found.L,
        start_up_samples=SAMPLES_PER_PARAMETER * settings.orders.n_parameters,
        two_mass=start,
    )
    estimator = entry(setup)
    trajectory = estimator.run(fed.total_torque_nm[:n], fed.output[:n], fed.okay[:n])
    model = estimator.model(fed.sample_time_s)
    judged = decimate(record, 1, settings.high_pass_hz) if raw else found.data
    fit = free_run(model, judged, white(judged.output, judged.okay)).fit_percent if model.is_stable else float(np.nan)
    last = trajectory[len(trajectory) - 1]
    return Compared(found.name, name, resonance(model, settings.band_hz), fit, last.status, last.reason.message)


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """One identification, examined.

    Attributes
    ----------
    found : Identification
        What was identified.
    best : BestEstimate
        The headline: Box-Jenkins model, pole pair with intervals, verdict.
    roots : PoleZeroMap
        Of the output-error model, with ellipses and what cancels.
    third_order : Reduced
        Equivalent of the output-error model.
    validation : Validation
        Of the output-error model, also on the other recordings.
    course : OnlineTrajectory
        The on-line estimate over the whole recording, with standard deviations.
    physical : PhysicalEstimate or None
        The two-mass drive; None where no such drive responds like this.
    not_physical : str
        Why there is none.
    """

    found: Identification
    best: BestEstimate
    roots: PoleZeroMap
    third_order: Reduced
    validation: Validation
    course: OnlineTrajectory
    physical: PhysicalEstimate | None
    not_physical: str

    @property
    def name(self) -> str:
        """The recording's."""
        return self.found.name

    @property
    def resonance(self) -> UncertainMode | None:
        """The best estimate's pole pair; None where the data carry none."""
        return self.best.mode

    @property
    def feedback(self) -> Feedback:
        """Whether the torque followed the speed."""
        return self.best.feedback


def study(record: Record, found: Identification, settings: Settings, others: Sequence[Identification] = ()) -> Study:
    """Examine an identification.

    Parameters
    ----------
    record : Record
        As recorded.
    found : Identification
        Of this recording with these settings.
    settings : Settings
        It was identified with.
    others : sequence of Identification
        Of other recordings with the same settings: the model is tried on each.
    """
    model, covariance = found.batch.model, found.batch.covariance
    best = best_estimate(record, settings.high_pass_hz)
    physical, not_physical = _physical(best)
    return Study(
        found=found,
        best=best,
        roots=pole_zero_map(model, covariance),
        third_order=third_order(model),
        validation=validate(found.batch, found.offline, [other.offline for other in others]),
        course=OnlineChain(settings, record.sample_time_s, found.L).run(record),
        physical=physical,
        not_physical=not_physical,
    )


def _physical(best: BestEstimate) -> tuple[PhysicalEstimate | None, str]:
    if best.verdict is ModelVerdict.ONE_MASS:
        return None, best.reason
    try:
        return physical_parameters(best.two_mass.model, best.two_mass.covariance), ""
    except BadModel as error:
        return None, str(error)
