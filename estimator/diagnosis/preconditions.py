"""Recordings that no diagnosis can be built on are refused before anything is fitted, with the reason."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimator.errors import BadShape, NotExciting
from estimator.physics.model import DrivelineModel
from estimator.physics.simulate import output_state
from estimator.signals.record import Record

FEWEST_SAMPLES = 200
"""Fewer good samples than this do not carry a model with a dozen unknowns and its hold-out."""


def check(records: Sequence[Record], model: DrivelineModel, holdout: Sequence[Record]) -> None:
    """Refuse recordings that do not belong together or excite nothing.

    Raises
    ------
    BadShape
        No recording, or different sampling periods, outputs or names used twice.
    NotExciting
        Too few good samples, or torque or output that does not change.
    BadModel
        A recorded output that the structure does not have.
    """
    if not records:
        raise BadShape("no recording was given, expected at least one")
    everything = [*records, *holdout]
    _same(everything)
    for record in everything:
        output_state(record, model.structure)
        _excited(record)


def _same(records: Sequence[Record]) -> None:
    first = records[0]
    names = [record.name for record in records]
    if len(set(names)) < len(names):
        raise BadShape(f"recordings must have different names, came {', '.join(names)}. Rename the files.")
    for record in records[1:]:
        if not np.isclose(record.sample_time_s, first.sample_time_s, rtol=1e-3):
            raise BadShape(
                f"recording {record.name}: sampling period {record.sample_time_s:g} s, expected "
                f"{first.sample_time_s:g} s as in {first.name}. Diagnose recordings of one period together."
            )
        if (record.kind, record.location) != (first.kind, first.location):
            raise BadShape(
                f"recording {record.name}: output is {record.kind.value} at the {record.location.value}, expected "
                f"{first.kind.value} at the {first.location.value} as in {first.name}."
            )


def _excited(record: Record) -> None:
    good = int(record.okay.sum())
    if good < FEWEST_SAMPLES:
        raise NotExciting(
            f"recording {record.name}: {good} good samples, expected at least {FEWEST_SAMPLES}. Record longer."
        )
    for what, values in (("torque", record.total_torque_nm), ("output", record.output)):
        seen = values[record.okay]
        if float(np.ptp(seen)) == 0.0:
            raise NotExciting(
                f"recording {record.name}: the {what} is constant at {seen[0]:g}, expected it to vary. "
                "Excite the driveline (PRBS, reversal, tip-in) and check the channel.",
                (record.name,),
            )
