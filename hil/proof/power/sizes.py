"""Effects with one size, and how a size is imposed on a specimen instead of the one that was drawn."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from hil.errors import UsageError
from hil.proof.truth.specimen import Specimen


@dataclass(frozen=True, slots=True)
class Scale:
    """What the size of an effect is.

    Attributes
    ----------
    key : str
        Which of the drawn sizes it moves.
    unit : str
    start : float
        A size, in ``unit``, from which a search begins.
    absent : float
        Value of ``key`` at which the effect is not there; the size is the distance from it.
    least : float
        Size that stands for none. Above 0 where the truth's law does not end in the linear one when it vanishes: a
        joint without any play still has contacts that cannot pull.
    """

    key: str
    unit: str
    start: float
    absent: float = 0.0
    least: float = 0.0


SCALES: Mapping[str, Scale] = {
    "inverter_gain_mismatch": Scale("gain_m1", "1", 0.01, absent=1.0),
    "actuator_lag": Scale("current_loop_time_s", "s", 1e-3),
    "coulomb_friction_motor": Scale("coulomb_nm", "Nm", 1.0),
    "quadratic_friction": Scale("drag_nm_s2", "Nm s^2/rad^2", 1e-3),
    "coulomb_friction_load": Scale("coulomb_nm", "Nm", 1.0),
    "backlash": Scale("gap_rad", "rad", 1e-3, least=1e-9),
}
"""Effects whose strength is one number, by their names."""


def imposed(specimen: Specimen, size: float) -> Specimen:
    """Return a specimen with the one effect it hides at a size, on the side of its absence that was drawn; 0 is absent.

    Raises
    ------
    UsageError
        If the specimen's effect has no single size.
    """
    scale = scale_of(specimen.effect)
    drawn = specimen.sizes[specimen.effect]
    value = scale.absent + math.copysign(size, drawn[scale.key] - scale.absent)
    return replace(specimen, sizes={specimen.effect: {**drawn, scale.key: value}})


def scale_of(effect: str) -> Scale:
    """Return what the size of an effect is.

    Raises
    ------
    UsageError
        If it has no single size.
    """
    if effect not in SCALES:
        raise UsageError(f"effect {effect!r}: expected one with a single size ({', '.join(SCALES)}).")
    return SCALES[effect]
