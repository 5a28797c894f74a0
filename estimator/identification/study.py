"""Everything an expert asks of one identification: how sure, how good, in closed loop or not, and of which drive.

What :func:`estimator.identification.identify.identify` found is taken as it is and examined; the best estimate, a
Box-Jenkins model (:mod:`estimator.identification.best`), stands first, and physical parameters are taken from its
third-order form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from estimator.errors import BadModel
from estimator.identification.best import BestEstimate, best_estimate
from estimator.identification.chain import OnlineChain
from estimator.identification.identify import Identification
from estimator.identification.modes.physical import PhysicalEstimate, physical_parameters
from estimator.identification.modes.reduced import Reduced, third_order
from estimator.identification.modes.uncertainty import PoleZeroMap, UncertainMode, pole_zero_map
from estimator.identification.offline.feedback import Feedback
from estimator.identification.offline.validation import Validation, validate
from estimator.identification.online_estimate import OnlineTrajectory
from estimator.identification.settings import Settings
from estimator.signals.record import Record


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
    try:
        return physical_parameters(best.two_mass.model, best.two_mass.covariance), ""
    except BadModel as error:
        return None, str(error)
