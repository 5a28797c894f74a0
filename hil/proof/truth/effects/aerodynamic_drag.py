"""Air drag of the vehicle, grown by the square of the speed (and of a head wind or a roof load)."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"drag_nm_s2": log_uniform(rng, 0.02, 0.08)}


EFFECT = HiddenEffect(
    "aerodynamic_drag", Place.LOAD, True, _draw, sets(quadratic_load="drag_nm_s2"), fitted={"drag_nm_s2": "drag_nm_s2"}
)
