"""What an off-line fit asks of a recording beyond what its type already guarantees."""

from __future__ import annotations

import numpy as np

from estimator.errors import BadSetting
from estimator.identification.excitation import require_excitation
from estimator.identification.linear_model import Orders
from estimator.signals.record import Record

PERIOD_TOLERANCE = 0.02
"""Relative. Jitter averages out over a recording; a wrong period is off by far more."""


def require_identifiable(record: Record, orders: Orders) -> None:
    """Refuse a recording that can't determine a model of these orders.

    Raises
    ------
    BadSetting
        If the sampling period given is not that of the time stamps: every frequency would be wrong by their ratio.
    NotExciting
        If the run is too short, the torque does not excite enough, or the output never changes; with their names.
    """
    stamped_s = float(np.median(np.diff(record.time_s))) if record.time_s.shape[0] > 1 else record.sample_time_s
    if abs(stamped_s - record.sample_time_s) > PERIOD_TOLERANCE * record.sample_time_s:
        raise BadSetting(
            f"recording {record.name}: sample_time_s is {record.sample_time_s:g}, its time stamps are {stamped_s:g} s "
            f"apart; expected one period. Frequencies would be wrong by {stamped_s / record.sample_time_s:.3g}; the "
            "resonance and the stiffness can't be determined. Correct the period or the time column's scale."
        )
    require_excitation(record.name, record.total_torque_nm, record.output, record.okay, orders)
