"""Dry friction at the wheels, the same at every speed: dragging pads, wheel bearings, axle seals."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Scale, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"coulomb_nm": log_uniform(rng, 7.0, 35.0)}


EFFECT = HiddenEffect(
    "coulomb_friction_load",
    Place.LOAD,
    True,
    _draw,
    sets(friction_load_nm="coulomb_nm"),
    fitted={"friction_nm": "coulomb_nm"},
    scale=Scale("Nm", 1.0),
)
