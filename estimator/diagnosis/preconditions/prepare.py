"""From recordings as they were read to such as a diagnosis can be built on, and back again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from estimator.diagnosis.acquisition import as_if_not_lost
from estimator.diagnosis.joined import joined
from estimator.diagnosis.preconditions.channels import with_usable_channels
from estimator.diagnosis.preconditions.clipped import without_clipped
from estimator.diagnosis.preconditions.exciting import require_excitation, require_signals
from estimator.diagnosis.preconditions.model_values import model_warnings
from estimator.diagnosis.preconditions.not_read import without_not_read
from estimator.diagnosis.preconditions.room import with_room
from estimator.diagnosis.preconditions.thinned import thinned
from estimator.diagnosis.preconditions.together import require_together
from estimator.diagnosis.preconditions.units import require_plausible_units
from estimator.diagnosis.preconditions.wrapped import unwrapped
from estimator.diagnosis.result import Diagnosis
from estimator.diagnosis.segments import Cut, cut
from estimator.errors import NotExciting
from estimator.physics.model import DrivelineModel
from estimator.physics.simulate import output_state
from estimator.signals.outputs import outputs_apart
from estimator.signals.record import Record


@dataclass(frozen=True, slots=True)
class Prepared:
    """Recordings fit for a diagnosis: cut at long gaps, without what was cut off, with what there is to say of them."""

    records: tuple[Record, ...]
    holdout: tuple[Record, ...]
    warnings: tuple[str, ...]
    segments: Cut

    def finished(self, diagnosis: Diagnosis) -> Diagnosis:
        """Return a diagnosis of these records under the recordings' own names, with the warnings."""
        whole = joined(diagnosis, self.segments)
        return replace(whole, warnings=(*self.warnings, *whole.warnings))


def as_moved(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Return recordings without what no sensor has read, and what there is to say of it."""
    warnings: list[str] = []
    mended = list(records)
    for mend in (unwrapped, without_clipped, without_not_read, with_usable_channels):
        mended, said = mend(mended)
        warnings += said
    return mended, warnings


def prepare(records: Sequence[Record], model: DrivelineModel, holdout: Sequence[Record] = ()) -> Prepared:
    """Check and mend recordings before anything is fitted.

    Raises
    ------
    BadShape
        No recording, or recordings that do not belong together.
    BadModel
        A recorded output that the structure does not have.
    NotExciting
        Too few good samples, too many gaps, or torque or output that does not change or excites nothing.
    Implausible
        Torque, output or time that is off by a factor or in sign.
    """
    require_together([*records, *holdout] if records else records)
    mended, warnings = as_moved([*records, *holdout])
    for record in mended:
        for each in outputs_apart([record], lambda _: 1.0):
            output_state(each, model.structure)
        require_signals(record)
    names = [record.name for record in records]
    segments, few = with_room(cut(thinned(mended, model)), names)
    training = segments.of(names)
    if not training:
        raise NotExciting(" ".join(segments.warnings), tuple(names))
    require_plausible_units(as_if_not_lost(segments.records), model)
    warnings += [*model_warnings(model), *segments.warnings, *few, *require_excitation(as_if_not_lost(training), model)]
    unseen = segments.of(record.name for record in holdout)
    return Prepared(training, unseen, tuple(warnings), segments)
