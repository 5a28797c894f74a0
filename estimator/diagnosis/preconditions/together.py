"""Recordings that one diagnosis can take together: of one period, one output, and names of their own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimator.errors import BadShape
from estimator.signals.record import Record

SAME_PERIOD = 1e-3
"""Relative difference of sampling periods that rounding of time stamps makes."""


def require_together(records: Sequence[Record]) -> None:
    """Refuse recordings that do not belong together.

    Raises
    ------
    BadShape
        No recording, or different sampling periods, outputs or numbers of torques, or a name used twice.
    """
    if not records:
        raise BadShape("no recording was given, expected at least one")
    first = records[0]
    names = [record.name for record in records]
    if len(set(names)) < len(names):
        raise BadShape(f"recordings must have different names, got {', '.join(names)}. Rename the files.")
    for record in records[1:]:
        if not np.isclose(record.sample_time_s, first.sample_time_s, rtol=SAME_PERIOD):
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
