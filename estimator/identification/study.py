"""Everything an expert asks of one identification: how sure, how good, in closed loop or not, and of which drive.

What :func:`estimator.identification.identify.identify` found is taken as it is; here it is questioned. Each part has
its derivation in its own module.

A second off-line model, by Box and Jenkins, of third order and at the recording's own period, stands beside: there the
torque was held from one sample to the next, which it is no more after the low-pass of the decimation, and its noise
model takes what the road does, which an output-error fit would take for parameters. It is the one physical parameters
are taken from, and the one that can tell feedback: the low-pass looks ahead, and so would a decimated residual.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from estimator.errors import BadModel, NotExciting
from estimator.identification.identify import Identification, Settings
from estimator.identification.modes.physical import RESPONDING, PhysicalEstimate, physical_parameters
from estimator.identification.modes.reduced import Reduced, third_order
from estimator.identification.modes.uncertainty import (
    PoleZeroMap,
    UncertainMode,
    pole_zero_map,
    uncertain_resonance,
)
from estimator.identification.offline.box_jenkins import fit_box_jenkins
from estimator.identification.offline.feedback import Feedback, judge_feedback
from estimator.identification.offline.linear_fit import LinearFit
from estimator.identification.offline.validation import Validation, validate
from estimator.identification.online.chain import OnlineChain
from estimator.identification.online.online_estimate import OnlineTrajectory
from estimator.signals.decimate import decimate
from estimator.signals.record import Record


@dataclass(frozen=True, slots=True, eq=False)
class NativeModel:
    """A third-order fit at the recording's own period, and its validation on that recording."""

    fit: LinearFit
    validation: Validation


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """One identification, questioned.

    Attributes
    ----------
    found : Identification
        What was identified.
    resonance : UncertainMode or None
        Of the off-line model, with intervals; None where it has none.
    roots : PoleZeroMap
        Of the off-line model, with ellipses and what cancels.
    third_order : Reduced
        Equivalent of the off-line model.
    validation : Validation
        Of the off-line model, also on the other recordings.
    native : NativeModel or None
        The third-order model at the recording's own period; None where there is none.
    feedback : Feedback or None
        Whether the torque followed the speed; None where there is no such model.
    course : OnlineTrajectory
        The on-line estimate over the whole recording, with standard deviations.
    physical : PhysicalEstimate or None
        The two-mass drive; None where no such drive responds like this.
    not_physical : str
        Why there is none; also why there is no native model.
    """

    found: Identification
    resonance: UncertainMode | None
    roots: PoleZeroMap
    third_order: Reduced
    validation: Validation
    native: NativeModel | None
    feedback: Feedback | None
    course: OnlineTrajectory
    physical: PhysicalEstimate | None
    not_physical: str

    @property
    def name(self) -> str:
        """The recording's."""
        return self.found.name


def study(record: Record, found: Identification, settings: Settings, others: Sequence[Identification] = ()) -> Study:
    """Question an identification.

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
    validation = validate(found.batch, found.data, [other.data for other in others])
    native, no_model = _native(record, settings)
    physical, not_physical = (None, no_model) if native is None else _physical(native.fit)
    return Study(
        found=found,
        resonance=uncertain_resonance(model, covariance, settings.band_hz),
        roots=pole_zero_map(model, covariance),
        third_order=third_order(model, covariance),
        validation=validation,
        native=native,
        feedback=None if native is None else judge_feedback(native.validation),
        course=OnlineChain(settings, record.sample_time_s, found.L).run(record),
        physical=physical,
        not_physical=not_physical,
    )


def _native(record: Record, settings: Settings) -> tuple[NativeModel | None, str]:
    """Fit a two-mass drive's structure at the recording's own period; or say why that can't be done."""
    data = decimate(record, 1, settings.high_pass_hz)
    try:
        fit = fit_box_jenkins(data, RESPONDING)
    except NotExciting as error:
        return None, str(error)
    return NativeModel(fit, validate(fit, data)), ""


def _physical(fit: LinearFit) -> tuple[PhysicalEstimate | None, str]:
    try:
        return physical_parameters(fit.model, fit.covariance), ""
    except BadModel as error:
        return None, str(error)
