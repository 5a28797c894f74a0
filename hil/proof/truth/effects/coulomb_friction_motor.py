"""Dry friction on the motor shaft, the same at every speed; bearings, seals, an oil pump's preload."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Scale, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"coulomb_nm": log_uniform(rng, 8.0, 40.0)}


EFFECT = HiddenEffect(
    "coulomb_friction_motor",
    Place.MOTOR,
    True,
    _draw,
    sets(friction_motor_nm="coulomb_nm"),
    fitted={"friction_nm": "coulomb_nm"},
    scale=Scale("Nm", 1.0),
)
