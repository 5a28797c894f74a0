"""Study of one identification: how sure, how good, in closed loop or not, of which drive; estimators side by side.

What :func:`estimator.identification.identify.identify` found is taken as it is and examined; the best estimate, a
Box-Jenkins model (:mod:`estimator.identification.best`), stands first, and physical parameters are taken from its
third-order form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.errors import BadModel
from estimator.identification.best import BestEstimate, Verdict, best_estimate
from estimator.identification.chain import OnlineChain, OnlineTrajectory
from estimator.identification.identify import Identification
from estimator.identification.modes.modes import Mode, resonance
from estimator.identification.modes.physical import PhysicalEstimate, physical_parameters
from estimator.identification.modes.reduced import Reduced, third_order
from estimator.identification.modes.uncertainty import PoleZeroMap, UncertainMode, pole_zero_map
from estimator.identification.offline.fits import free_run
from estimator.identification.offline.noise_model import white
from estimator.identification.offline.validation import Feedback, Validation, validate
from estimator.identification.online.ekf import TwoMass
from estimator.identification.online.recursive import Status
from estimator.identification.online.registry import Entry, Feed, Setup
from estimator.identification.settings import SAMPLES_PER_PARAMETER, Settings
from estimator.signals.decimate import decimate
from estimator.signals.record import Record


@dataclass(frozen=True, slots=True)
class Compared:
    """What one estimator made of one recording."""

    recording: str  # names
    estimator: str
    resonance: Mode | None  # of its last model
    fit_percent: float
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
    if best.verdict is Verdict.ONE_MASS:
        return None, best.reason
    try:
        return physical_parameters(best.two_mass.model, best.two_mass.covariance), ""
    except BadModel as error:
        return None, str(error)
