"""What a recording says of its scales by itself, without a model: signs, swapped columns, a speed that no motor has.

The torque accelerates the line: over a second its impulse accounts for the change of speed, whatever the inertia is
(``inertia.as_one_body``). Where it does so only with two columns changed for one another, or with a sign turned, that
is what is wrong.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from estimator.diagnosis.preconditions.inertia import BODY_TELLS, Inertia, as_one_body
from estimator.errors import Cure, Implausible
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.signals.record import OutputKind, Record

FASTEST_RAD_S = 2500.0
"""Speed of a traction motor that is not reached: 24,000 rpm. A speed in rpm is."""

RPM = math.pi / 30.0

CLEARLY = 0.5
"""Share of the unexplained motion that may be left with columns changed or a torque turned round."""

_BODY = DrivelineModel(Structure.ONE_MASS, {"J_M": Parameter(1.0, 0.0), "b_M": Parameter(0.0, 0.0)})


def require_plausible_alone(record: Record) -> None:
    """Refuse a recording whose columns are swapped, or off in sign or by a unit, whatever the model is.

    Raises
    ------
    Implausible
        With what cures it.
    """
    if record.kind is OutputKind.FORCE:
        return
    fastest = float(np.abs(record.output[record.okay]).max())
    if record.kind is OutputKind.SPEED and fastest > FASTEST_RAD_S:
        raise Implausible(
            f"recording {record.name}: a speed of {fastest:.0f} rad/s is more than a drive reaches. Is it in rpm?",
            Cure(record.name, output=RPM),
        )
    found = _moved(record)
    _refuse_swapped(record, found)
    _refuse_turned(record, found)
    if found.share >= BODY_TELLS and found.ratio < 0.0:
        raise Implausible(
            f"recording {record.name}: the {record.kind.value} falls where the torque rises. Is the sign of one of "
            "them turned round?",
            Cure(record.name, output=-1.0),
        )


def _moved(record: Record) -> Inertia:
    """Return the inertia that moves as one body [kg m^2], and how much of the motion the torque accounts for."""
    return as_one_body(record, _BODY, 0.0)


def _is_clearer(other: Inertia, found: Inertia) -> bool:
    return other.share >= BODY_TELLS and 1.0 - other.share < CLEARLY * (1.0 - found.share)


def _refuse_swapped(record: Record, found: Inertia) -> None:
    for i in range(record.torque_nm.shape[1]):
        torque, good = record.torque_nm.copy(), np.flatnonzero(record.okay)
        torque[:, i] = np.interp(np.arange(record.okay.size), good, record.output[good])
        other = _moved(replace(record, torque_nm=torque, output=record.torque_nm[:, i], torque_okay=None))
        if other.ratio > 0.0 and _is_clearer(other, found):
            raise Implausible(
                f"recording {record.name}: torque input {i + 1} moves as the {record.kind.value} should, and vice "
                "versa. Are their columns swapped?",
                Cure(record.name, swapped=i),
            )


def _refuse_turned(record: Record, found: Inertia) -> None:
    for i in range(record.torque_nm.shape[1] if record.torque_nm.shape[1] > 1 else 0):
        turned = record.torque_nm.copy()
        turned[:, i] *= -1.0
        other = _moved(replace(record, torque_nm=turned))
        if other.ratio > 0.0 and _is_clearer(other, found):
            raise Implausible(
                f"recording {record.name}: the {record.kind.value} follows the torques with the sign of input {i + 1} "
                "turned round. All torques count positive in the direction of the speed.",
                Cure(record.name, torque=-1.0, inputs=(i,)),
            )
