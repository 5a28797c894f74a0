"""From recordings as given to recordings that can be diagnosed: each check and each mending in its turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.acquisition.chain import without_lost_samples
from estimator.diagnosis.preconditions.channels import (
    require_signals,
    with_motion_corrected,
)
from estimator.diagnosis.preconditions.excitation import model_warnings, require_excitation
from estimator.diagnosis.preconditions.plausible import doubtful
from estimator.diagnosis.result import Diagnosis, Doubt
from estimator.diagnosis.segments import Cut, cut, joined, shortened_to_memory, thinned
from estimator.diagnosis.thresholds import Mistakes
from estimator.errors import BadShape, NotExciting, made_of_each
from estimator.physics.model import DrivelineModel
from estimator.physics.parallel import TimeIsUp
from estimator.physics.simulate import output_state
from estimator.signals.record import Record, separated_outputs


def require_together(records: Sequence[Record]) -> None:
    """Refuse recordings that do not belong together."""
    if not records:
        raise BadShape("no recording was given, expected at least one")
    first = records[0]
    names = [record.name for record in records]
    if len(set(names)) < len(names):
        raise BadShape(f"recordings must have different names, got {', '.join(names)}. Rename the files.")
    for record in records[1:]:
        if not np.isclose(record.sample_time_s, first.sample_time_s, rtol=Mistakes.SAME_PERIOD):
            raise BadShape(
                f"recording {record.name}: sampling period {record.sample_time_s:g} s, expected "
                f"{first.sample_time_s:g} s as in {first.name}. Diagnose recordings of one period together."
            )
        if (record.kind, record.location) != (first.kind, first.location):
            raise BadShape(
                f"recording {record.name}: output is {record.kind.value} at the {record.location.value}, expected "
                f"{first.kind.value} at the {first.location.value} as in {first.name}."
            )
        if record.torque_nm.shape[1] != first.torque_nm.shape[1]:
            raise BadShape(
                f"recording {record.name}: {record.torque_nm.shape[1]} torque inputs, expected "
                f"{first.torque_nm.shape[1]} as in {first.name}. Give every recording the same inputs."
            )


@dataclass(frozen=True, slots=True)
class Prepared:
    """Recordings fit for a diagnosis: cut at long gaps, without what was cut off, with what there is to say of them."""

    records: tuple[Record, ...]  # to be fitted
    holdout: tuple[Record, ...]  # kept out of every fit
    warnings: tuple[str, ...]  # as sentences
    segments: Cut  # which part of which recording each record is
    doubts: tuple[Doubt, ...] = ()  # about the input

    def finished(self, diagnosis: Diagnosis) -> Diagnosis:
        """Return a diagnosis of these records under the recordings' own names, with their warnings."""
        whole = joined(diagnosis, self.segments)
        return replace(whole, warnings=(*self.warnings, *whole.warnings))


def prepare(records: Sequence[Record], model: DrivelineModel, holdout: Sequence[Record] = ()) -> Prepared:
    """Check and correct recordings before anything is fitted."""
    require_together([*records, *holdout] if records else records)
    corrected, warnings = with_motion_corrected([*records, *holdout])
    for record in corrected:
        for each in separated_outputs([record], lambda _: 1.0):
            output_state(each, model.structure)
    made_of_each(corrected, require_signals, NotExciting, NotExciting)
    names = [record.name for record in records]
    pieces, few = shortened_to_memory(cut(thinned(corrected, model)), names)
    training = pieces.of(names)
    if not training:
        raise NotExciting(" ".join(pieces.warnings), tuple(names))
    try:
        doubts = doubtful([*records, *holdout], model)
        unexcited = require_excitation(without_lost_samples(training), model)
    except TimeIsUp:  # nothing will be decided in any case
        doubts, unexcited = [], ["whether units and excitation are plausible was not looked at: the time was up"]
    warnings += [*model_warnings(model), *pieces.warnings, *few, *unexcited]
    unseen = pieces.of(record.name for record in holdout)
    return Prepared(training, unseen, tuple(warnings), pieces, tuple(doubts))
